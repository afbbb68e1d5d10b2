"""The earlier runs of one place: every look that their logs hold, and the memory that they make at a later moment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import hypot

from workbench.beliefs.memory.memory import Memory, NoEarlierRun, PastLook, remember
from workbench.beliefs.memory.move_rates import NS_PER_DAY, MoveRates
from workbench.errors import InputError, first_few
from workbench.worlds.house import Container, FloorPlan

SAME_SPOT_M = 0.5
"""A container whose pose differs by no more has not been moved: surveys are that exact."""

MAX_NAMED = 4
"""Places that a message names."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EarlierRun:
    """One run: its id, its log, and when it was, in nanoseconds since the Unix epoch."""

    id: str
    log: str
    started_ns: int
    ended_ns: int


@dataclass(frozen=True, slots=True, kw_only=True)
class History:
    """What the logs of one place hold.

    Attributes:
        plan: the place, as the first log has it.
        runs: sorted by their ends.
        looks: sorted by time.
        notes: what people corrected in the logs, one line each: taken as certain, or left out.
    """

    plan: FloorPlan = field(repr=False)
    runs: tuple[EarlierRun, ...]
    looks: tuple[PastLook, ...]
    notes: tuple[str, ...] = ()

    def memory_at(self, at_ns: int, plan: FloorPlan, rates: MoveRates) -> Memory:
        """The memory of a run that begins at a moment in a place; of runs that ended by then.

        Raises:
            AnotherPlace, ContainersChanged: the logs are of something else.
            NoEarlierRun: no run had ended.
        """
        require_same_place(self.plan, plan, self.runs[0].log if self.runs else "")
        over = {run.id for run in self.runs if run.ended_ns <= at_ns}
        if not over:
            raise NoEarlierRun
        return remember((look for look in self.looks if look.run in over), at_ns=at_ns, rates=rates)

    def next_day_ns(self, first_ns: int) -> int:
        """The first moment that is whole days after `first_ns` and after every run."""
        last = max((run.ended_ns for run in self.runs), default=first_ns)
        return first_ns + NS_PER_DAY * max(0, -(-(last - first_ns) // NS_PER_DAY))


class AnotherPlace(InputError):
    """A log of a memory is of another place."""

    def __init__(self, log: str, place: str, wanted: str) -> None:
        super().__init__(
            f"{log}: a log of {place}, not of {wanted}. Give --memory only logs of the place of the run."
        )


class NoRunOfPlace(InputError):
    """Logs of a memory of which none is of the run's place."""

    def __init__(self, wanted: str, *, others: str = "", where: str = "--memory") -> None:
        found = f"its logs are of {others}, and none is of" if others else "it holds nothing to remember of"
        super().__init__(
            f"{where}: {found} {wanted}, the place of the run. Give --memory logs of that place, or leave it out."
        )


class SeveralPlaces(InputError):
    """Logs of several places where those of one are needed."""

    def __init__(self, where: str, places: str) -> None:
        super().__init__(f"{where}: logs of several places ({places}). Give only logs of one place.")


class ContainersChanged(InputError):
    """A log of a memory is of the same place, with other containers."""

    def __init__(self, log: str, place: str, changes: Sequence[str]) -> None:
        shown = "; ".join(changes[:3]) + (f"; and {len(changes) - 3} more" if len(changes) > 3 else "")
        super().__init__(
            f"{log}: the containers of {place} have changed since ({shown}). Leave earlier logs out of --memory."
        )


def history_for(histories: Sequence[History], plan: FloorPlan) -> History:
    """Of histories of several places that of a place.

    Raises:
        NoRunOfPlace: there is none.
    """
    for history in histories:
        if not _changes(history.plan, plan):
            return history
    raise NoRunOfPlace(plan.name)


def places_in_words(names: Sequence[str]) -> str:
    """The distinct names of places, at most MAX_NAMED of them."""
    return first_few(sorted(set(names)), MAX_NAMED)


def require_same_place(before: FloorPlan, now: FloorPlan, log: str) -> None:
    """Check that a log is of a place, with the same containers.

    Raises:
        AnotherPlace: another name, and other containers.
        ContainersChanged: the same name, and a container that was added, removed, exchanged or moved.
    """
    changes = _changes(before, now)
    if changes and before.name != now.name:
        raise AnotherPlace(log, before.name, now.name)
    if changes:
        raise ContainersChanged(log, now.name, changes)


def _changes(before: FloorPlan, now: FloorPlan) -> list[str]:
    old, new = ({c.id: c for c in plan.containers} for plan in (before, now))
    changes = [f"{c} is gone" for c in old if c not in new] + [f"{c} is new" for c in new if c not in old]
    return changes + [f"{c} {how}" for c in old if c in new and (how := _change(old[c], new[c]))]


def _change(before: Container, now: Container) -> str:
    if before.type != now.type:
        return f"was {before.type} and is {now.type}"
    if before.room != now.room:
        return f"was in {before.room} and is in {now.room}"
    moved_m = hypot(before.pose.x_m - now.pose.x_m, before.pose.y_m - now.pose.y_m)
    return f"was moved by {moved_m:.1f} m" if moved_m > SAME_SPOT_M else ""
