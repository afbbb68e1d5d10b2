"""The memory of earlier runs in a place: their looks with times, and the last look into each container."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

from workbench.beliefs.memory.fit_rates import RevisitInterval, fit_pace
from workbench.beliefs.memory.move_rates import NS_PER_DAY, MoveRates
from workbench.errors import BadValue, InputError
from workbench.worlds.house import ContainerId, ItemType

REARRANGED = 0.7
"""Prior probability that everything was moved since the last look, whatever the rates say. Of 0.5, 0.7 and 0.85 it
saves most over training houses in which one item in four has moved, and loses less than 3 % where all have
(docs/memory.md)."""
REARRANGED_BEFORE = 0.5
"""That of logs that do not say it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PastLook:
    """What a container held at one moment of an earlier run.

    Attributes:
        seen_ns: nanoseconds since the Unix epoch.
        item_types: sorted, each once.
        missed: the chance that the look overlooked something that was there; 0 for a look that shows everything.
        run: the run's id.
        changed: the robot itself had taken or put something there; what it had seen stays true of the rest.
        corrected: of the item types, those that the looks missed and a person's correction says were there.
    """

    container: ContainerId
    seen_ns: int
    item_types: tuple[ItemType, ...]
    run: str
    missed: float = 0.0
    changed: bool = False
    corrected: tuple[ItemType, ...] = field(default=(), repr=False)  # item_types has them: they change no digest

    def __post_init__(self) -> None:
        if not 0 <= self.missed < 1:
            raise BadValue("chance of a miss in memory", self.missed, "at least 0 and below 1")


class NoEarlierRun(InputError):
    """No log of a memory ended before the run began."""

    def __init__(self) -> None:
        super().__init__(
            "no log of --memory ended before this run began. Give logs of earlier runs, or leave --memory out."
        )


@dataclass(frozen=True, kw_only=True)
class Memory:
    """What a robot remembers at the start of a run. A run's log keeps it whole.

    Attributes:
        at_ns: the start of the run; ages are counted to it.
        looks: the last one into each container, sorted by container.
        rates: how often things move.
        pace: this household's factor on the rates, as its own logs show it.
        runs: ids of the runs that are remembered, sorted.
        rearranged: the prior probability that everything was moved, whatever the rates say.

    Raises:
        BadValue: two looks into one container, a look after the start, a pace that is not above 0, or a prior outside
            [0, 1).
    """

    at_ns: int
    looks: tuple[PastLook, ...]
    rates: MoveRates
    pace: float = 1.0
    runs: tuple[str, ...] = ()
    rearranged: float = REARRANGED

    def __post_init__(self) -> None:
        containers = [look.container for look in self.looks]
        if len(set(containers)) != len(containers):
            raise BadValue("containers of a memory", containers, "named once each")
        if any(look.seen_ns > self.at_ns for look in self.looks):
            raise BadValue("memory", "a look after the run began", "of earlier looks only")
        if not 0 < self.pace < float("inf"):
            raise BadValue("pace of a memory", self.pace, "above 0")
        if not 0 <= self.rearranged < 1:
            raise BadValue("chance that everything was moved", self.rearranged, "at least 0 and below 1")

    @cached_property
    def by_container(self) -> Mapping[ContainerId, PastLook]:
        return MappingProxyType({look.container: look for look in self.looks})

    @cached_property
    def digest(self) -> str:
        """Eight hexadecimal digits of all that it holds."""
        rates = self.rates.others, sorted(self.rates.by_type.items())
        prior = () if self.rearranged == REARRANGED_BEFORE else (self.rearranged,)
        held = (self.at_ns, self.looks, rates, self.pace, self.runs, *prior)
        return hashlib.sha256(repr(held).encode()).hexdigest()[:8]

    def days_since(self, look: PastLook) -> float:
        return (self.at_ns - look.seen_ns) / NS_PER_DAY

    def stays(self, look: PastLook, item_type: ItemType) -> float:
        """The chance that an item of a type has not moved since a look, in (0, 1]."""
        return math.exp(-self.pace * self.rates.of(item_type) * self.days_since(look))


def remember(history: Iterable[PastLook], *, at_ns: int, rates: MoveRates) -> Memory:
    """The memory at a moment: of each container the last look before it, and the pace that the looks show.

    Raises:
        NoEarlierRun: every look was later.
    """
    past = sorted(
        (look for look in history if look.seen_ns <= at_ns), key=lambda look: (look.seen_ns, look.container)
    )
    if not past:
        raise NoEarlierRun
    last: dict[ContainerId, PastLook] = {look.container: look for look in past}
    return Memory(
        at_ns=at_ns,
        looks=tuple(last[c] for c in sorted(last)),
        rates=rates,
        pace=fit_pace(intervals(past), rates),
        runs=tuple(sorted({look.run for look in past})),
    )


def intervals(history: Iterable[PastLook]) -> tuple[RevisitInterval, ...]:
    """Each item type seen in a container: how long until another run looked there again, and whether it stayed."""
    found: list[RevisitInterval] = []
    before: dict[ContainerId, PastLook] = {}
    for look in sorted(history, key=lambda look: (look.seen_ns, look.container)):
        earlier = before.get(look.container)
        if earlier is not None and not look.changed and earlier.run != look.run:
            days = (look.seen_ns - earlier.seen_ns) / NS_PER_DAY
            found += [
                RevisitInterval(item_type=t, days=days, stayed=t in look.item_types) for t in earlier.item_types
            ]
        before[look.container] = look
    return tuple(found)
