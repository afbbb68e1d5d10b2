"""Worlds sampled from the belief given all observations of the log, for estimates; never for bounds.

Open containers hold each relevant type independently with the belief's probability. A type of which the log shows
no instance, but which is known to exist, is in at least one of them: drawn exactly, container by container, by the
chance that it is in none of those still to come (the `exists` model of docs/concepts/belief-models.md, as a
sampler). One world is a table of answers, the same for every strategy: comparisons are paired.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from replayers.counterfactual.estimates.sampled_misses import MissWeights, odds_of, sample_misses
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.relevance import Answer, Relevance
from replayers.counterfactual.run_tree import Choose, UnobservedLook
from workbench.arrays import Bools, Floats
from workbench.beliefs.belief import Belief
from workbench.caches import PerObject
from workbench.worlds.house import ContainerId, ItemType

MAX_CACHED_ANSWERS = 1000

Worlds = int
"""A set of worlds: bit k is set where world k is in it."""

_ANSWERS: PerObject[tuple[ContainerId, tuple[ItemType, ...]], tuple[tuple[Answer, Worlds], ...]] = PerObject(
    MAX_CACHED_ANSWERS
)
"""By the contents of sampled worlds, what each container answers, and in which worlds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledWorlds:
    """Worlds that are consistent with a log, sampled from the belief.

    Attributes:
        containers: the open ones, and those in which looks may have missed something.
        item_types: the relevant types.
        inside: shape (worlds, item types, containers), read-only: whether an instance is there that the log does not
            show.
    """

    containers: tuple[ContainerId, ...]
    item_types: tuple[ItemType, ...]
    inside: Bools

    def __len__(self) -> int:
        return self.inside.shape[0]

    def answer(self, world: int, container: ContainerId, live: tuple[ItemType, ...]) -> Answer:
        """What a container holds in a world, restricted to the types that still matter."""
        there = self.inside[world, :, self.containers.index(container)].tolist()
        return tuple([t for t, is_there in zip(self.item_types, there, strict=True) if is_there and t in live])

    def answers(self, container: ContainerId, live: tuple[ItemType, ...]) -> tuple[tuple[Answer, Worlds], ...]:
        """What a container may hold, restricted to the types that still matter, each with the worlds in which it
        does."""
        return _ANSWERS.of(self.inside).get((container, live), lambda: self._answers(container, live))

    def _answers(self, container: ContainerId, live: tuple[ItemType, ...]) -> tuple[tuple[Answer, Worlds], ...]:
        found: list[tuple[Answer, Worlds]] = [((), (1 << len(self)) - 1)]
        column = self.containers.index(container)
        for i, item_type in enumerate(self.item_types):
            if item_type in live:
                there = worlds_of(self.inside[:, i, column])
                split = [((*answer, item_type), some & there) for answer, some in found]
                found = [one for one in (*[(a, some & ~there) for a, some in found], *split) if one[1]]
        return tuple(found)

    def chooser(self, world: int) -> Choose:
        """A function that gives the contents of each open container of a run as they are in one world."""

        def choose(unobserved: UnobservedLook) -> Answer:
            answer = self.answer(world, unobserved.container, unobserved.live)
            return answer if unobserved.allows(answer) else unobserved.options[0]

        return choose


def worlds_of(chosen: Bools) -> Worlds:
    """The set of the worlds that are marked; shape (worlds,)."""
    return int.from_bytes(np.packbits(chosen, bitorder="little").tobytes(), "little")


def marked(worlds: Worlds, count: int) -> Bools:
    """Which of so many worlds are in a set, shape (count,)."""
    packed = np.frombuffer(worlds.to_bytes((count + 7) // 8, "little"), dtype=np.uint8)
    return np.unpackbits(packed, count=count, bitorder="little").view(np.bool_)


def sample_worlds(
    evidence: Evidence,
    relevance: Relevance,
    belief: Belief,
    *,
    count: int,
    rng: np.random.Generator,
    exists: frozenset[ItemType],
) -> SampledWorlds:
    """Samples worlds.

    Args:
        belief: over at least the open containers and the relevant types; a pair that it does not name has probability
            0.
        exists: types of which an instance is somewhere.
    """
    if evidence.misses:
        return _with_misses(evidence, relevance, belief, count=count, rng=rng, exists=exists)
    containers = evidence.open
    inside = np.zeros((count, len(relevance.types), len(containers)), dtype=bool)
    for i, item_type in enumerate(relevance.types):
        probability = _row(belief, item_type, containers)
        somewhere = item_type in exists and item_type not in evidence.seen_types()
        inside[:, i, :] = _sample_presence(probability, count, rng, at_least_one=somewhere)
    inside.flags.writeable = False
    return SampledWorlds(containers=containers, item_types=relevance.types, inside=inside)


def _with_misses(
    evidence: Evidence,
    relevance: Relevance,
    belief: Belief,
    *,
    count: int,
    rng: np.random.Generator,
    exists: frozenset[ItemType],
) -> SampledWorlds:
    """Worlds in which recorded looks overlooked something, drawn by the chance of that.

    Where the log assumes that no look misses, none is taken to have missed more than the inventory implies.
    """
    types, unopened, doubtful = relevance.types, evidence.open, evidence.doubtful
    seen = evidence.seen_types()
    somewhere = np.array([t in exists and t not in seen for t in types], dtype=bool)
    chances = np.array([_row(belief, t, unopened) for t in types]).reshape(len(types), len(unopened))
    implied = int(somewhere.sum()) if not unopened and not relevance.hidden else 0
    most, odds = evidence.misses, _odds(evidence, belief, types, assumed=True)
    if not odds.any():
        most, odds = implied, _odds(evidence, belief, types, assumed=False)
    for i in np.flatnonzero(somewhere & ~odds.any(axis=1)) if implied else ():
        odds[i] = 1.0  # it is somewhere, and no place is likelier than another
    weights = MissWeights(
        odds=odds,
        required=somewhere & (not relevance.hidden),
        elsewhere=1.0 - np.prod(1.0 - chances, axis=1) if unopened else np.zeros(len(types)),
        least=implied,
        most=most,
    )
    missed = sample_misses(weights, count, rng)
    inside = np.zeros((count, len(types), len(unopened)), dtype=bool)
    for i in range(len(types)):
        found = missed[:, i].any(axis=1)
        inside[:, i] = _sample_presence(chances[i], count, rng, at_least_one=False)
        if somewhere[i] and not found.all():
            inside[~found, i] = _sample_presence(chances[i], int((~found).sum()), rng, at_least_one=True)
    both = np.concatenate([inside, missed], axis=2)
    both.flags.writeable = False
    return SampledWorlds(containers=(*unopened, *doubtful), item_types=types, inside=both)


def _odds(evidence: Evidence, belief: Belief, types: tuple[ItemType, ...], *, assumed: bool) -> Floats:
    """The odds of each type in each container that was looked into without it, shape (types, containers).

    Args:
        assumed: times the chance that every look missed it, as the log assumes it; otherwise the belief's alone.
    """
    doubtful = evidence.doubtful
    odds = np.zeros((len(types), len(doubtful)))
    for i, item_type in enumerate(types):
        without = np.array([all(item.type != item_type for item in evidence.contents[c]) for c in doubtful])
        missed = np.array([evidence.miss_chance.get((item_type, c), 0.0) if assumed else 1.0 for c in doubtful])
        odds[i] = odds_of(_row(belief, item_type, doubtful)) * without * missed
    return odds


def _row(belief: Belief, item_type: ItemType, containers: tuple[ContainerId, ...]) -> Floats:
    if item_type not in belief.item_types:
        return np.zeros(len(containers))
    known: Mapping[ContainerId, float] = dict(zip(belief.containers, belief.of(item_type).tolist(), strict=True))
    return np.array([known.get(c, 0.0) for c in containers])


def _sample_presence(probability: Floats, count: int, rng: np.random.Generator, *, at_least_one: bool) -> Bools:
    """Presence in each container, bool, shape (count, containers). With at least one, each draw is conditioned on
    those to come."""
    chance = rng.random((count, len(probability)))
    if not at_least_one or not len(probability):
        return np.asarray(chance < probability)
    if not probability.any():
        probability = np.full(len(probability), 1.0 / len(probability))
    none_later = np.cumprod((1.0 - probability)[::-1])[::-1]
    drawn = np.zeros_like(chance, dtype=bool)
    found = np.zeros(count, dtype=bool)
    for j, p in enumerate(probability):
        some_from_here = 1.0 - none_later[j]
        here = p / some_from_here if some_from_here > 0 else 1.0
        drawn[:, j] = chance[:, j] < np.where(found, p, here)
        found |= drawn[:, j]
    return drawn
