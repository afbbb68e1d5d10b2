"""Bounds on what each strategy would have cost, by what a growing log shows so far, and what they prove together.

Every world that agrees with a log also agrees with each shorter part of it, so that bounds of the part hold for the
whole: a lower bound never falls and an upper bound never rises while a run is recorded. `tightened` keeps that
where a budget gave wider bounds the next time. It ends where the log shows something that no world of the shorter
part had: a container that refuses, or a look that must have missed (`Basis`).
"""

from __future__ import annotations

from enum import StrEnum
from math import inf

import msgspec

from workbench.tolerances import NEAR_COST


class Basis(msgspec.Struct, frozen=True, kw_only=True):
    """What bounds over parts of one log have in common; where it changes, earlier bounds say nothing any more.

    Attributes:
        run_id: which run.
        beliefs: who believes, and whether the beliefs are fixed and exact.
        refused: containers, moves and picks that were refused.
        misses: how many items looks may have overlooked.
        corrected: what people said was there although no look showed it.
        lost: what is missing from the log.
    """

    run_id: str
    beliefs: tuple[str, bool, bool]
    refused: tuple[str, ...]
    misses: int
    corrected: tuple[str, ...]
    lost: tuple[str, ...]


class GhostBounds(msgspec.Struct, frozen=True, kw_only=True):
    """What one strategy would have cost, over all worlds that agree with the log so far.

    Attributes:
        strategy: its name.
        driven: it is the one that is recorded.
        lower, upper: charged costs; infinite where there is no upper bound.
        outer: a bound may be wider than what is known, because the budget was spent.
        least_extra, most_extra: bounds of the driven strategy's cost minus this one's, over all worlds.
        status: of its run over the log alone ("undetermined" where it would look into what nobody opened yet).
        trouble: why it has no bounds; empty where it has.
        charged: what the recorded run was charged, once it has ended. On a robot that differs a little from what its
            replay costs, which walks the ways of the map as the ghosts do; None for a ghost and before the end.
    """

    strategy: str
    driven: bool = False
    lower: float = 0.0
    upper: float = inf
    outer: bool = False
    least_extra: float = -inf
    most_extra: float = inf
    status: str = ""
    trouble: str = ""
    charged: float | None = None

    @property
    def exact(self) -> bool:
        """Whether all worlds that agree with the log give the same cost."""
        return self.upper - self.lower <= NEAR_COST


class GhostReport(msgspec.Struct, frozen=True, kw_only=True):
    """What a round gave.

    Attributes:
        log_bytes: how much of the log it is about.
        opened: containers whose contents the log shows.
        decisions: decisions of the driven run.
        seconds: how long the round took, from reading the log on.
        segments: segments of the loop that one strategy's bounds might take.
        bounds: the driven strategy first, where it can be replayed, then the ghosts in their order.
        line: what they prove, as a sentence; empty where there is nothing to compare.
        note: what a reader should know; empty for nothing.
        ended: why nothing more will come; empty while something may.
    """

    log_bytes: int = 0
    opened: int = 0
    decisions: int = 0
    seconds: float = 0.0
    segments: int = 0
    bounds: tuple[GhostBounds, ...] = ()
    line: str = ""
    note: str = ""
    ended: str = ""


class GhostVerdict(StrEnum):
    """What is proven about the driven strategy, whatever the unopened containers hold."""

    BEATEN = "beaten"
    """Another one costs less in every world."""
    BEST = "best"
    """None of the others costs less in any world."""
    OPEN = "open"
    """Neither, so far."""


def tightened(now: GhostBounds, before: GhostBounds | None) -> GhostBounds:
    """Bounds that are nowhere wider than those of a shorter part of the same log.

    Args:
        now: of the log as it is.
        before: of a part of it, on the same basis; None where there is none.
    """
    if before is None or before.trouble or now.trouble:
        return now
    return msgspec.structs.replace(
        now,
        lower=max(now.lower, before.lower),
        upper=min(now.upper, before.upper),
        outer=now.outer and not max(now.lower, before.lower) >= min(now.upper, before.upper) - NEAR_COST,
        least_extra=max(now.least_extra, before.least_extra),
        most_extra=min(now.most_extra, before.most_extra),
    )


def verdict(bounds: tuple[GhostBounds, ...]) -> GhostVerdict:
    """What is proven about the driven strategy beside the others."""
    ghosts = [b for b in bounds if not b.driven]
    if any(not b.trouble and b.least_extra > NEAR_COST for b in ghosts):
        return GhostVerdict.BEATEN
    if ghosts and all(not b.trouble and b.most_extra <= NEAR_COST for b in ghosts):
        return GhostVerdict.BEST
    return GhostVerdict.OPEN


def verdict_line(bounds: tuple[GhostBounds, ...]) -> str:
    """The verdict as a sentence with its figures; empty where nothing is compared."""
    driven = next((b.strategy for b in bounds if b.driven), "")
    ghosts = [b for b in bounds if not b.driven and not b.trouble]
    if not driven or not ghosts:
        return ""
    found = verdict(bounds)
    if found is GhostVerdict.BEATEN:
        by = max(ghosts, key=lambda b: b.least_extra)
        return (
            f"{driven} is provably beaten: {by.strategy} costs at least {by.least_extra:.1f} less, "
            "whatever the unopened containers hold."
        )
    if found is GhostVerdict.BEST:
        names = ", ".join(b.strategy for b in ghosts)
        return f"{driven} is provably best: it costs no more than {names}, whatever the unopened containers hold."
    return f"Open: {driven} is neither provably beaten nor provably best."
