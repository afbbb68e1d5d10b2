"""Findings of a check before a run: what was looked at, what it is, and whether it forbids the run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class Level(StrEnum):
    """What a finding means for a run."""

    OK = "ok"
    WARNING = "warning"
    FORBIDS = "forbids"


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One line of a check.

    Attributes:
        subject: what was checked, in one or two words.
        text: what was found, and where something is wrong, what to do.
    """

    subject: str
    level: Level
    text: str

    def as_json(self) -> dict[str, str]:
        return {"subject": self.subject, "level": self.level.value, "text": self.text}


def fine(subject: str, text: str) -> Finding:
    return Finding(subject=subject, level=Level.OK, text=text)


def warning(subject: str, text: str) -> Finding:
    return Finding(subject=subject, level=Level.WARNING, text=text)


def forbids(subject: str, text: str) -> Finding:
    return Finding(subject=subject, level=Level.FORBIDS, text=text)


def forbid_a_run(findings: Iterable[Finding]) -> bool:
    """Whether a run must not begin."""
    return any(finding.level is Level.FORBIDS for finding in findings)


def in_lines(findings: Iterable[Finding]) -> str:
    """One line a finding: its level, its subject, its text."""
    return "\n".join(f"{finding.level:<8} {finding.subject:<13} {finding.text}" for finding in findings)
