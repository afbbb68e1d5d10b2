"""Findings of the doctor: each states one fact, with its severity, place and remedy."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum


class Level(StrEnum):
    """How serious a finding is."""

    ERROR = "error"
    """Something in the log is not what it should be."""
    LOSS = "loss"
    """Something is missing that had been recorded, or should have been."""
    WARNING = "warning"
    """Worth a look."""
    INFO = "info"


class Verdict(StrEnum):
    """What the findings of a log amount to, and the exit code for it."""

    FINE = "fine"
    FAULTY = "faulty"
    LOSSY = "lossy"

    @property
    def exit_code(self) -> int:
        return {Verdict.FINE: 0, Verdict.FAULTY: 1, Verdict.LOSSY: 3}[self]


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One fact about what is wrong.

    Attributes:
        where: a byte offset, a topic with its decision, or an attachment.
        fix: what to do; "" when nothing need be done.
    """

    level: Level
    where: str
    what: str
    fix: str = ""


MAX_PER_KIND = 20
"""More findings of one kind are counted, not listed: a file of zeros must not fill the memory."""


@dataclass(slots=True)
class Findings:
    """Collects findings; the first ones of each kind are kept and the rest counted."""

    kept_by_kind: list[tuple[str, Finding]] = field(default_factory=list)
    counts: dict[tuple[Level, str], int] = field(default_factory=dict)

    def add(self, level: Level, where: str, what: str, fix: str = "", *, kind: str = "") -> None:
        """Adds a finding.

        Args:
            kind: what findings have in common; by default their first words.
        """
        kind = kind or what[:24]
        count = self.counts.get((level, kind), 0) + 1
        self.counts[level, kind] = count
        if count <= MAX_PER_KIND:
            self.keep(Finding(level=level, where=where, what=what, fix=fix), kind)

    def keep(self, finding: Finding, kind: str) -> None:
        """Keeps a finding that has been counted already."""
        self.kept_by_kind.append((kind, finding))

    def error(self, where: str, what: str, fix: str = "", *, kind: str = "") -> None:
        self.add(Level.ERROR, where, what, fix, kind=kind)

    def warning(self, where: str, what: str, fix: str = "", *, kind: str = "") -> None:
        self.add(Level.WARNING, where, what, fix, kind=kind)

    def all(self) -> list[Finding]:
        """The findings that were kept, worst first, and one line for each kind of which there are more."""
        more = [
            Finding(level=level, where="", what=f"{count - MAX_PER_KIND} more like: {kind}")
            for (level, kind), count in self.counts.items()
            if count > MAX_PER_KIND
        ]
        order = list(Level)
        return sorted(
            [*(finding for _, finding in self.kept_by_kind), *more], key=lambda finding: order.index(finding.level)
        )

    @property
    def verdict(self) -> Verdict:
        levels = {level for level, _ in self.counts}
        if Level.ERROR in levels:
            return Verdict.FAULTY
        return Verdict.LOSSY if Level.LOSS in levels else Verdict.FINE
