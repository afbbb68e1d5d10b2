"""An estimator that remembers: another estimator's beliefs, moved towards what earlier runs saw.

For each item type and container the belief is a mixture of two: as the place was seen last (weight k, the chance
that the item has not moved since), and as the estimator believes without memory (weight 1 - k). As seen last means 1
where the type was seen, 0 where it was not (or the posterior of a look that can miss), and elsewhere what the
estimator believes once it knows the remembered containers. k falls with the age of the look and with how often such
things move.

The hypothesis that everything in the house was rearranged, in which case no memory holds, has a prior probability of
its own. Every look into a remembered container updates it by Bayes, and each k is multiplied by the posterior
probability that the house was not rearranged. A robot that finds the first three remembered things gone stops
believing the rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from workbench.arrays import Floats
from workbench.beliefs.asking.answered_estimator import AnsweredEstimator
from workbench.beliefs.belief import Belief, Estimator
from workbench.beliefs.memory.memory import Memory, PastLook
from workbench.errors import BadValue
from workbench.worlds.house import Item, ItemId, ItemType
from workbench.worlds.knowledge import Knowledge

COMES_BACK = 0.1
"""Chance that a container from which a thing was moved holds one of its type again."""
DIGITS = 12
"""Probabilities are rounded to so many decimals: products in another order differ beyond."""
MARK = "+memory-"
"""Between the estimator's name and the memory's digest in a name."""


@final
@dataclass(frozen=True, slots=True, weakref_slot=True, kw_only=True)
class MemoryEstimator:
    """An estimator with a memory.

    Attributes:
        base: the estimator without memory.
        memory: what is remembered; looks into containers that a floor plan lacks say nothing.
    """

    base: Estimator
    memory: Memory

    @property
    def name(self) -> str:
        """The estimator's name with the memory's digest: "best@1a2b3c4d+memory-5e6f7a8b"."""
        return f"{self.base.name}{MARK}{self.memory.digest}"

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        """The belief over unsearched containers."""
        now = self.base.believe(knowledge, item_types)
        if not now.probability.size:
            return replace(now, estimator=self.name)
        holds = 1.0 - rearranged(self.memory, knowledge)
        then = self._as_seen_last(knowledge, now)
        weight = holds * self._weights(now, knowledge)
        probability = np.round(weight * then + (1.0 - weight) * now.probability, DIGITS)
        return replace(now, probability=np.clip(probability, 0.0, 1.0), estimator=self.name)

    def _as_seen_last(self, knowledge: Knowledge, now: Belief) -> Floats:
        """What would be believed if nothing had moved, shape as the belief's."""
        remembered = self.memory.by_container
        imagined = knowledge
        for container in now.containers:
            if container in remembered and container not in knowledge.first_seen:
                imagined = imagined.seen(container, _items(remembered[container]))
        then = now.probability.copy()
        if imagined.unsearched:
            other = self.base.believe(imagined, now.item_types)
            column = {c: j for j, c in enumerate(other.containers)}
            for j, container in enumerate(now.containers):
                if container in column:
                    then[:, j] = other.probability[:, column[container]]
        for j, container in enumerate(now.containers):
            if container in remembered:
                then[:, j] = _shown(remembered[container], now, j)
        return then

    def _weights(self, belief: Belief, knowledge: Knowledge) -> Floats:
        """The chance that nothing has moved which the memory says of each pair, shape as the belief's.

        A type that is gone from where it was seen has moved, perhaps to a place where it was not seen before: the
        memory then says nothing about its other places, except those where another instance was seen.
        """
        memory, remembered = self.memory, self.memory.by_container
        weights = np.zeros(belief.probability.shape)
        for i, item_type in enumerate(belief.item_types):
            gone = _is_gone(memory, knowledge, item_type)
            elsewhere = 0.0 if gone else memory.stays(_judging_look(memory, item_type), item_type)
            for j, container in enumerate(belief.containers):
                look = remembered.get(container)
                if look is None:
                    weights[i, j] = elsewhere
                elif not gone or item_type in look.item_types:
                    weights[i, j] = memory.stays(look, item_type)
        return weights


def with_memory(estimator: Estimator, memory: Memory | None) -> Estimator:
    """The estimator with a memory; itself where there is none.

    Raises:
        BadValue: the estimator's answers cost something: those that it gives by what is remembered are in no log.
    """
    if memory is None:
        return estimator
    if isinstance(estimator, AnsweredEstimator):
        raise BadValue("--memory", estimator.name, "used with an estimator that asks no questions")
    return MemoryEstimator(base=estimator, memory=memory)


def without_memory(name: str) -> str:
    """An estimator's name without its memory: "best@1a2b3c4d"."""
    return name.partition(MARK)[0]


def rearranged(memory: Memory, knowledge: Knowledge) -> float:
    """The posterior chance that everything was moved, given what is now in the remembered containers seen so far."""
    moved, stands = memory.rearranged, 1.0 - memory.rearranged
    for container, items in sorted(knowledge.first_seen.items()):
        look = memory.by_container.get(container)
        if look is None:
            continue
        here = {item.type for item in items}
        for item_type in look.item_types:
            stays = memory.stays(look, item_type)
            again = stays + (1.0 - stays) * COMES_BACK
            moved *= COMES_BACK if item_type in here else 1.0 - COMES_BACK
            stands *= again if item_type in here else 1.0 - again
        total = moved + stands
        moved, stands = (moved / total, stands / total) if total > 0 else (1.0, 0.0)
    return moved / (moved + stands)


def _is_gone(memory: Memory, knowledge: Knowledge, item_type: ItemType) -> bool:
    """Whether a container in which a type was remembered has been looked into without it."""
    return any(
        item_type in look.item_types
        and look.container in knowledge.first_seen
        and all(item.type != item_type for item in knowledge.first_seen[look.container])
        for look in memory.looks
    )


def _items(look: PastLook) -> tuple[Item, ...]:
    return tuple(Item(id=ItemId(f"remembered|{look.container}|{t}"), type=t) for t in look.item_types)


def _shown(look: PastLook, belief: Belief, column: int) -> Floats:
    """What a look showed of each type: 1, or 0; where it can miss, the posterior of an empty look."""
    prior = belief.probability[:, column]
    unseen = prior * look.missed
    empty = np.divide(unseen, 1.0 - prior + unseen, out=np.zeros_like(prior), where=unseen > 0)
    seen = np.array([t in look.item_types for t in belief.item_types])
    return np.where(seen, 1.0, empty)


def _judging_look(memory: Memory, item_type: ItemType) -> PastLook:
    """The look by which a type's other places are judged: the last that showed it, else the last of all."""
    showed = [look for look in memory.looks if item_type in look.item_types]
    return max(showed or memory.looks, key=lambda look: (look.seen_ns, look.container))
