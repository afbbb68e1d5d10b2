"""Relevance of contents to the cost of a run: the task's item types, each up to its demand.

Two worlds that agree on the *answers* of their open containers give every strategy the same run, if the strategy
keeps the contract of docs/replay.md. An answer is a sorted tuple of item types with repetitions: which relevant
types lie there, each at most as often as the task can use it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache, reduce
from itertools import combinations_with_replacement, product
from math import prod
from operator import or_
from types import MappingProxyType

from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.evidence_rules import OVERLOOKED
from workbench.errors import BadValue
from workbench.execution.goal_check import is_met
from workbench.planning.actions import relevant_types
from workbench.planning.tasks import AllOf, AnyOf, Goal, plain_deliveries
from workbench.worlds.house import ContainerId, Item, ItemId, ItemType
from workbench.worlds.knowledge import Knowledge

Answer = tuple[ItemType, ...]
"""The relevant contents of an open container: sorted item types, with repetitions; () for none."""

NOTHING: Answer = ()

MAX_ANSWERS = 64
"""An open container of a kitchen can hold any of a thousand subsets of what a breakfast may use. With more answers
than this, those with the fewest items are followed, and all others together get outer bounds."""

MAX_CACHED = 4096
"""Sets of answers, and the items that answers stand for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Assumptions:
    """What is assumed beyond the log.

    Attributes:
        inventory: the task's list of available item types is complete and correct: each is somewhere, and no other
            is (the paper's prior knowledge, Sec. III). No effect where the task lists none.
        unique: where the log shows instances of a type, there are no others (an operator who laid out marked objects
            knows that).
        misses: how many items the recorded looks may have overlooked; None for as many as the inventory implies.
    """

    inventory: bool = True
    unique: bool = False
    misses: int | None = None

    def __post_init__(self) -> None:
        if self.misses is not None and self.misses < 0:
            raise BadValue("misses", self.misses, "0 or more overlooked items")


@dataclass(frozen=True, slots=True, kw_only=True)
class Relevance:
    """What matters in the open containers of one log for one task.

    Attributes:
        types: relevant item types that an open container may hold, sorted.
        most: how many instances of each the task can use.
        must_exist: types of which an instance is somewhere.
        hidden: whether some container can hold items that no robot can see (unreachable, or refusing searches).
        finishing: types that stop mattering once the goal's parts that name them are met.
        shown: relevant types that no open container may hold, because the log shows all their instances. Where those
            stand still matters.
    """

    types: tuple[ItemType, ...]
    most: Mapping[ItemType, int]
    must_exist: frozenset[ItemType]
    hidden: bool
    finishing: Mapping[ItemType, Goal]
    unique: bool = False
    shown: tuple[ItemType, ...] = ()

    def live(self, knowledge: Knowledge) -> tuple[ItemType, ...]:
        """The types that open containers may hold and that still matter, given what has been done."""
        return self._unfinished(self.types, knowledge)

    def live_and_shown(self, knowledge: Knowledge) -> tuple[ItemType, ...]:
        """All types that still matter: where their instances stand distinguishes states."""
        return self._unfinished((*self.types, *self.shown) if self.shown else self.types, knowledge)

    def _unfinished(self, types: tuple[ItemType, ...], knowledge: Knowledge) -> tuple[ItemType, ...]:
        finishing, where = self.finishing, knowledge.where  # nothing is delivered of a type that is known nowhere
        return tuple([t for t in types if not where(t) or t not in finishing or not is_met(finishing[t], knowledge)])

    def options(
        self,
        live: tuple[ItemType, ...],
        *,
        found_before: frozenset[ItemType],
        open_left: int,
        seen: frozenset[ItemType],
    ) -> tuple[tuple[Answer, ...], bool]:
        """The answers that an open container can give, the empty one first; and whether there are others besides.

        Args:
            live: the types that still matter.
            found_before: types that open containers held before.
            open_left: how many open containers are left besides this one.
            seen: types of which the log shows an instance.
        """
        before = found_before
        counts: list[tuple[int, int]] = []
        for t in live:
            most = 0 if self.unique and (t in seen or t in before) else self.most[t]
            last_chance = open_left == 0 and not self.hidden and t in self.must_exist
            least = 1 if last_chance and t not in seen and t not in before else 0
            counts.append((least, max(most, least)))
        return _answers_with(live, tuple(counts), MAX_ANSWERS)


def relevance_of(evidence: Evidence, asked: Iterable[ItemType], assumptions: Assumptions) -> Relevance:
    """What matters over a log.

    Args:
        asked: the types for which a strategy requests beliefs; the goal's own always matter.
    """
    task = evidence.task
    wanted = set(relevant_types(task.goal)) | set(asked)
    listed = frozenset(task.available) if assumptions.inventory else frozenset[ItemType]()
    seen = evidence.seen_types()
    types = tuple(sorted(wanted & (listed | seen) if listed else wanted))
    shown = tuple(t for t in types if t in seen) if assumptions.unique else ()
    types = tuple(t for t in types if t not in shown)
    most = demand(task.goal)
    looked = set(evidence.contents) | set(evidence.open)
    if evidence.misses:  # what was overlooked where no robot comes again, no robot learns
        looked = {*evidence.known, *evidence.doubtful, *evidence.open}
    return Relevance(
        types=types,
        most=MappingProxyType({t: max(1, most[t]) for t in types}),
        must_exist=frozenset(t for t in types if t in listed),
        hidden=any(c.id not in looked for c in evidence.place.plan.containers),
        finishing=MappingProxyType(_finishing(task.goal, (*types, *shown))),
        unique=assumptions.unique,
        shown=shown,
    )


def max_instances(goal: Goal) -> int:
    """The number of a goal's parts that can be worked on together: no type needs more instances than this."""
    if isinstance(goal, AllOf):
        return sum(max_instances(part) for part in goal.parts)
    if isinstance(goal, AnyOf):
        return max((max_instances(part) for part in goal.parts), default=0)
    return 1


def demand(goal: Goal) -> Counter[ItemType]:
    """How many instances of each type one execution of a goal can use: one for each part that names it or prepares
    with it; over alternatives, the largest."""
    if isinstance(goal, AllOf):
        return sum((demand(part) for part in goal.parts), Counter())
    if isinstance(goal, AnyOf):
        return reduce(or_, (demand(part) for part in goal.parts), Counter())
    return Counter(relevant_types(goal))


def imputed_items(answer: Answer, container: ContainerId, shown: Iterable[Item] | None = None) -> tuple[Item, ...]:
    """The instances that an answer stands for, with ids that mark them as imputed.

    Args:
        shown: what the log shows in the container, where the answer is what was overlooked there; no id comes twice.
    """
    if not answer:
        return ()
    return _imputed(answer, container) if shown is None else _named(answer, container, OVERLOOKED, shown)


@lru_cache(maxsize=MAX_CACHED)
def _imputed(answer: Answer, container: ContainerId) -> tuple[Item, ...]:
    return _named(answer, container, "|imputed|", ())


def _named(answer: Answer, container: ContainerId, mark: str, shown: Iterable[Item]) -> tuple[Item, ...]:
    """Instances whose ids hold a mark; no id comes twice."""
    taken = {item.id for item in shown}
    counted: Counter[ItemType] = Counter()
    items: list[Item] = []
    for t in answer:
        counted[t] += 1
        while f"{t}{mark}{container}|{counted[t]}" in taken:
            counted[t] += 1
        items.append(Item(id=ItemId(f"{t}{mark}{container}|{counted[t]}"), type=t))
    return tuple(items)


@lru_cache(maxsize=MAX_CACHED)
def _answers_with(
    live: tuple[ItemType, ...], counts: tuple[tuple[int, int], ...], at_most: int
) -> tuple[tuple[Answer, ...], bool]:
    """The answers that hold, of each type, between so many items and so many, the empty one first; and whether there
    are others besides."""
    if prod(high - low + 1 for low, high in counts) > at_most:
        return _smallest_answers(live, counts, at_most), True
    every = product(*(range(low, high + 1) for low, high in counts))
    answers = (tuple(t for t, n in zip(live, ns, strict=True) for _ in range(n)) for ns in every)
    return tuple(sorted(answers, key=lambda a: (len(a), a))), False


def _smallest_answers(
    live: tuple[ItemType, ...], counts: tuple[tuple[int, int], ...], at_most: int
) -> tuple[Answer, ...]:
    """The answers with the fewest items, as many as are explored."""
    at_least = tuple(t for t, (low, _) in zip(live, counts, strict=True) for _ in range(low))
    room = {t: high - low for t, (low, high) in zip(live, counts, strict=True)}
    found: list[Answer] = []
    for size in range(sum(room.values()) + 1):
        for more in combinations_with_replacement(live, size):
            if len(found) == at_most:
                return tuple(found)
            if all(more.count(t) <= room[t] for t in more):
                found.append(tuple(sorted((*at_least, *more))))
    return tuple(found)


def _finishing(goal: Goal, types: tuple[ItemType, ...]) -> dict[ItemType, Goal]:
    """For plain deliveries, the parts of the goal that a type serves: once they are met, it no longer matters."""
    parts = plain_deliveries(goal)
    named = {t: tuple(part for part in parts if part.item_type == t) for t in types}
    return {t: mine[0] if len(mine) == 1 else AllOf(parts=mine) for t, mine in named.items() if mine}
