"""Findings of a check before a run: what was looked at, what it is, and whether it forbids the run."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class CheckLevel(StrEnum):
    """What a finding means for a run."""

    OK = "ok"
    WARNING = "warning"
    FORBIDS = "forbids"


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckFinding:
    """One line of a check.

    Attributes:
        subject: what was checked, in one or two words.
        text: what was found, and where something is wrong, what to do.
    """

    subject: str
    level: CheckLevel
    text: str

    def as_json(self) -> dict[str, str]:
        return {"subject": self.subject, "level": self.level.value, "text": self.text}


def fine(subject: str, text: str) -> CheckFinding:
    return CheckFinding(subject=subject, level=CheckLevel.OK, text=text)


def warning(subject: str, text: str) -> CheckFinding:
    return CheckFinding(subject=subject, level=CheckLevel.WARNING, text=text)


def forbids(subject: str, text: str) -> CheckFinding:
    return CheckFinding(subject=subject, level=CheckLevel.FORBIDS, text=text)


def forbid_a_run(findings: Iterable[CheckFinding]) -> bool:
    """Whether a run must not begin."""
    return any(finding.level is CheckLevel.FORBIDS for finding in findings)


def in_lines(findings: Iterable[CheckFinding]) -> str:
    """One line a finding: its level, its subject, its text."""
    return "\n".join(f"{finding.level:<8} {finding.subject:<13} {finding.text}" for finding in findings)
