"""Whether a decision is the same had open containers held more instances of a type than answers count.

Answers count instances up to the demand: where the goal uses one book, a container with two counts as one with one.
As long as the counted ones stand where they were found, another changes nothing: it is in the same place. Once the
robot has taken them and still needs that type (it put the book down on the way, or the grounds beside a pot that has
no water yet), the other might be nearer. Then the strategy is asked again with every combination of what may be left
there. To ask once, as if everything were there, is not enough: with two more, the cheapest plan may begin as it does
without, and with one of them not; and among plans of equal cost a solver may take another.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import prod
from types import MappingProxyType
from typing import final

from replayers.counterfactual.decisions.decided import Decided
from replayers.counterfactual.decisions.memoized_strategy import DecisionBasis
from replayers.counterfactual.decisions.same_decision import next_steps
from replayers.counterfactual.decisions.watched_belief import decide_watched
from replayers.counterfactual.relevance import Relevance
from workbench.planning.strategy import Decision, Strategy
from workbench.worlds.house import ContainerId, Item, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge

ANOTHER = "|another|"

MAX_COMBINATIONS = 31
"""With more combinations of further instances than this, a decision counts as one that they may change."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class MayHoldMore:
    """Up to so many further instances of a type that a container may hold and that might be used."""

    container: ContainerId
    item_type: ItemType
    most: int


@final
class AnotherInstance:
    """The test for one strategy.

    Args:
        unseen: the containers whose contents the log does not show in full.
        relevance: which types matter, and up to how many.
        whatever_else: where beliefs follow all that is seen, whether a decision is the same whatever else is there;
            None where they do not.
    """

    def __init__(
        self,
        strategy: Strategy,
        unseen: Collection[ContainerId],
        relevance: Relevance,
        whatever_else: Callable[[DecisionBasis, Decision], bool] | None,
    ) -> None:
        self._strategy = strategy
        self._unseen = unseen
        self._relevance = relevance
        self._whatever_else = whatever_else

    def changes_nothing(self, decided: Iterable[Decided]) -> bool:
        """Whether the strategy does the same next, in each of these decisions, if there is another instance of what
        was taken. A decision of which nobody knows what it was made by (a planner from outside) is not looked at."""
        return all(self._decides_alike(one) for one in decided)

    def _decides_alike(self, decided: Decided) -> bool:
        knowledge = decided.knowledge
        rooms = () if knowledge is None else room_for_more(knowledge, self._unseen, self._relevance)
        if knowledge is None or not rooms:
            return True
        if combinations_of(rooms) > MAX_COMBINATIONS:
            return False
        basis, made = decided.basis, decided.made
        assert basis is not None, "what the robot knew is known"
        return all(self._decides_alike_with(more, basis, made) for more in with_more(knowledge, rooms))

    def _decides_alike_with(self, more: Knowledge, basis: DecisionBasis, made: Decision) -> bool:
        view = replace(basis.view, knowledge=more)
        again, read = decide_watched(self._strategy, view)
        if next_steps(again) != next_steps(made):
            return False
        if self._whatever_else is None:
            return True
        return set(read) <= set(basis.read) and self._whatever_else(replace(basis, view=view), made)


def room_for_more(
    knowledge: Knowledge, unseen: Collection[ContainerId], relevance: Relevance
) -> tuple[MayHoldMore, ...]:
    """Where more may be than answers count, of each type that still matters: containers that held as many as answers
    count, of which some are gone. What is left there and the more together need not exceed the demand.

    Args:
        unseen: the containers whose contents the log does not show in full.
    """
    found: list[MayHoldMore] = []
    for container in unseen:
        first = knowledge.first_seen.get(container)
        if not first or knowledge.items_at.get(LocationId(container)) == first:
            continue
        gone = _gone(container, knowledge)
        shown = Counter(item.type for item in knowledge.first_seen[container])
        for t in sorted(gone.keys() & set(relevance.live(knowledge))):
            most = relevance.most[t] - (shown[t] - gone[t])
            if shown[t] >= relevance.most[t] and most > 0:
                found.append(MayHoldMore(container=container, item_type=t, most=most))
    return tuple(found)


def combinations_of(rooms: Sequence[MayHoldMore]) -> int:
    """In how many ways there may be something in some of these places."""
    return prod(room.most + 1 for room in rooms) - 1


def with_more(knowledge: Knowledge, rooms: Sequence[MayHoldMore]) -> Iterator[Knowledge]:
    """The knowledge if there were more, in every way; first as much as there may be, which is likeliest to matter."""
    for counts in product(*(range(room.most, -1, -1) for room in rooms)):
        if not any(counts):
            continue
        first, now = dict(knowledge.first_seen), dict(knowledge.items_at)
        for room, count in zip(rooms, counts, strict=True):
            at = LocationId(room.container)
            items = tuple([_another(room, number) for number in range(1, count + 1)])
            first[room.container] += items
            now[at] = (*now.get(at, ()), *items)
        yield replace(knowledge, first_seen=MappingProxyType(first), items_at=MappingProxyType(now))


def _another(room: MayHoldMore, number: int) -> Item:
    return Item(id=ItemId(f"{room.item_type}{ANOTHER}{room.container}|{number}"), type=room.item_type)


def _gone(container: ContainerId, knowledge: Knowledge) -> Counter[ItemType]:
    """How many of each type a look showed in a container that are no longer there; what is in hand there is: a plan
    that takes another later could put it back as well."""
    first, place = knowledge.first_seen[container], LocationId(container)
    there = knowledge.items_at.get(place, ())
    if knowledge.robot_at == place and knowledge.holding is not None:
        there = (*there, knowledge.holding)
    return Counter([item.type for item in first if item not in there])
