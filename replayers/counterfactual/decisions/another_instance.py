"""Whether a decision is the same had open containers held more instances of a type than answers count.

Answers count instances up to the demand: where the goal uses one book, a container with two counts as one with one.
As long as the counted ones stand where they were found, another changes nothing: it is in the same place. Once the
robot has taken them and still needs that type (it put the book down on the way, or the grounds beside a pot that has
no water yet), the other might be nearer. Then the strategy is asked again, as if another of each such type were
there. If it does the same next with all of them, it does so with any of them: its plan is still among the possible
ones, and none of those that they add was better.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from types import MappingProxyType
from typing import final

from replayers.counterfactual.decisions.memoized_strategy import DecisionBasis
from replayers.counterfactual.decisions.same_decision import next_steps
from replayers.counterfactual.decisions.watched_belief import decide_watched
from replayers.counterfactual.relevance import Relevance
from workbench.planning.strategy import Decision, Strategy
from workbench.worlds.house import ContainerId, Item, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge

ANOTHER = "|another|"


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

    def changes_nothing(self, decided: Iterable[tuple[DecisionBasis | None, Decision]]) -> bool:
        """Whether the strategy does the same next, in each of these decisions, if there is another instance of what
        was taken. A decision of which nobody knows what it was made by (a planner from outside) is not looked at."""
        return all(basis is None or self._decides_alike(basis, made) for basis, made in decided)

    def _decides_alike(self, basis: DecisionBasis, made: Decision) -> bool:
        more = with_another(basis.view.knowledge, self._unseen, self._relevance)
        if more is None:
            return True
        view = replace(basis.view, knowledge=more)
        again, read = decide_watched(self._strategy, view)
        if next_steps(again) != next_steps(made):
            return False
        if self._whatever_else is None:
            return True
        return set(read) <= set(basis.read) and self._whatever_else(replace(basis, view=view), made)


def with_another(knowledge: Knowledge, unseen: Collection[ContainerId], relevance: Relevance) -> Knowledge | None:
    """The knowledge if containers held another of each type that still matters, where they held as many as answers
    count and some are gone; None where there is no such container.

    Args:
        unseen: the containers whose contents the log does not show in full.
    """
    more: dict[ContainerId, tuple[Item, ...]] = {}
    for container in unseen:
        gone = _types_gone(container, knowledge)
        if gone and (types := sorted(gone.intersection(relevance.live(knowledge)))):
            shown = Counter(item.type for item in knowledge.first_seen[container])
            capped = [t for t in types if shown[t] >= relevance.most[t]]
            more[container] = tuple([Item(id=ItemId(f"{t}{ANOTHER}{container}"), type=t) for t in capped])
    if not any(more.values()):
        return None
    first, now = dict(knowledge.first_seen), dict(knowledge.items_at)
    for container, items in more.items():
        first[container] += items
        now[LocationId(container)] = (*now.get(LocationId(container), ()), *items)
    return replace(knowledge, first_seen=MappingProxyType(first), items_at=MappingProxyType(now))


def _types_gone(container: ContainerId, knowledge: Knowledge) -> frozenset[ItemType]:
    """The types of what a look showed in a container and is no longer there; what is in hand there is: a plan that
    takes another later could put it back as well."""
    first, place = knowledge.first_seen.get(container), LocationId(container)
    if not first:
        return frozenset()
    there = knowledge.items_at.get(place, ())
    if knowledge.robot_at == place and knowledge.holding is not None:
        there = (*there, knowledge.holding)
    return frozenset([item.type for item in first if item not in there])
