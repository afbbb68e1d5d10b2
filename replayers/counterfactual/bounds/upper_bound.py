"""Upper bounds on the remaining cost of a run, over all consistent worlds.

The bounds hold for strategies that go *straight*: besides looks they only fetch what a part of the goal asks for and
bring it there, each part once; they look only while something is missing; and they do not give up while all that is
needed can be found. Every run that is explored is checked against that; a strategy that breaks it has no upper bound.
A closer one is for those that look into the nearest container first (nearest_legs).

Where a recorded pick failed and left the item there, a strategy may come back for it, and there is no such bound.

Where things are to be prepared there is no such bound either. After every look a strategy may decide to prepare other
items, with other tools or elsewhere, and carry things once more; how often is not known.
"""

from __future__ import annotations

from collections import Counter
from itertools import accumulate, permutations
from math import inf
from typing import final

import numpy as np

from replayers.counterfactual.bounds.direct_route import longest_legs
from replayers.counterfactual.bounds.travel_row import travel_row
from replayers.counterfactual.estimates.complete_linkage import merge_widths
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.relevance import max_instances
from replayers.counterfactual.strategy_traits import UNKNOWN, SearchTraits
from workbench.arrays import Floats
from workbench.caches import Cache
from workbench.execution.goal_check import is_met
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Goal, Holding
from workbench.worlds.house import ItemType, LocationId
from workbench.worlds.knowledge import Knowledge

MAX_CACHED_LEGS = 20_000
MAX_ORDERED = 5
"""Deliveries of which every order is compared."""


@final
class UpperBound:
    """The upper bounds for one log and one task, in metres and their equivalents.

    Args:
        traits: what is known of the strategy.
    """

    def __init__(self, evidence: Evidence, traits: SearchTraits = UNKNOWN) -> None:
        travel = evidence.place.travel
        self._metres: Floats = np.asarray(travel.metres)
        self._index = {name: i for i, name in enumerate(travel.locations)}
        self._costs = evidence.costs
        self._goal = evidence.task.goal
        self._traits = traits
        self._refused_picks, self._refused_moves = evidence.refused_picks, evidence.refused_moves
        self._one_way = not _has_alternatives(self._goal)
        self._searchable = tuple(
            LocationId(c) for c in (*evidence.contents, *evidence.open, *evidence.refused_searches)
        )
        self._places = [(c, self._index[c]) for c in self._searchable if c in self._index]
        self._in_passing = frozenset(map(LocationId, evidence.passing.open if evidence.passing is not None else ()))
        self._parts = _leaves(self._goal)
        self._wanted = Counter(part.item_type for part in self._parts)
        self._into: Cache[tuple[tuple[int, ...], tuple[int, ...]], float] = Cache(MAX_CACHED_LEGS)
        self._last: tuple[Knowledge, tuple[Delivered | Holding, ...], bool] | None = None
        self.fits_straight = _is_plain_delivery(self._goal) and not evidence.left
        self.max_picks = max_instances(self._goal)

    def nothing_missing(self, knowledge: Knowledge) -> bool:
        """Whether a distinct reachable instance is known for every part that is left: no look is needed."""
        return self._unmet_and_known(knowledge)[1]

    def direct_route_bound(self, knowledge: Knowledge) -> float:
        """For strategies that go straight, from a state on: every look that is left, and every fetch.

        Such a run is a chain of legs: into a container to look, to an item to pick it, to a place to bring it. A leg
        to a look or to an item starts where the leg before ended: here, at a look (each is made once), where a part
        was brought (once a part), or, with the hand full, where an item stood (once a part). So the most
        expensive assignment of distinct starts to these legs bounds their sum from above (an assignment problem); the
        most expensive delivery of each part is added.
        """
        left, all_known = self._unmet_and_known(knowledge)
        if self._traits.plans_shortest and all_known and (known := self._known_route(left, knowledge)) is not None:
            return known
        looks = [] if all_known else self._left_to_look(knowledge)
        parts = [part for part in left if part.at in self._index]
        stand = [self._known_sites(part, knowledge) for part in parts]
        here = self._index.get(knowledge.robot_at, -1)
        ends = [self._index[part.at] for part in parts]
        if here < 0 and not looks and not ends:
            return 0.0
        fetches = min(self.max_picks, len(parts))
        longest = longest_legs(
            self._metres,
            here,
            np.array(looks, dtype=np.int64),
            np.array(ends, dtype=np.int64),
            np.array([at for places in stand for at in places], dtype=np.int64),
            np.array([0, *accumulate(map(len, stand))], dtype=np.int64),
            fetches,
            not self._traits.empty_handed,
        )
        carried = sum(sorted(longest.brought.tolist(), reverse=True)[:fetches])
        legs = float(longest.assigned.sum())
        if self._traits.nearest_first and looks:
            into = self._nearest_legs(tuple(looks), (*([here] if here >= 0 else []), *ends))
            legs = min(legs, into + sum(sorted(longest.fetched.tolist(), reverse=True)[:fetches]))
        return legs + self._costs.search * len(looks) + (carried + 2 * fetches * self._costs.manipulation)

    def detours(self, knowledge: Knowledge) -> float:
        """What a robot that stops for tags seen in passing walks besides, from a state on.

        A way to a container that is abandoned for an item costs no more than going on to that container and from
        there to what comes next (triangle inequality): two legs more. It makes an item known that a part lacked, and
        so happens at most once a part.
        """
        left = self._unmet_parts(knowledge)
        if self._all_known(left, knowledge):
            return 0.0
        return 2 * len(left) * float(self._metres.max(initial=0.0))

    def seeing(self, knowledge: Knowledge, *, walking: bool) -> float:
        """For strategies that go straight with a robot that sees in passing, from a state on.

        Every move is one on which something comes into view, one that leads to a look, one that fetches or one that
        delivers. A move on which nothing new comes into view is as in direct_route_bound; of the others there are no
        more than containers that can be seen. Moves that stop on the way end no farther from anywhere than had they
        gone on, by the triangle inequality: each counts as a whole one, and none is longer than the longest way.

        Args:
            walking: the robot is on a move on which something came into view that it does not know yet.
        """
        left = tuple(part for part in self._unmet_parts(knowledge) if part.at in self._index)
        row = travel_row(knowledge, self._index, self._metres)
        if len(left) == 1 and not walking and row is not None and self._one_way:
            part, held = left[0], knowledge.holding
            if held is not None and held.type == part.item_type:
                return float(row[self._index[part.at]]) + self._costs.manipulation * isinstance(part, Delivered)
        places = [self._index[c] for c in self._searchable if c in self._index]
        ends = [self._index[part.at] for part in left]
        stand = [at for part in left for at in self._known_sites(part, knowledge)]
        among = sorted({*places, *ends, *stand})
        longest = float(self._metres[np.ix_(among, among)].max(initial=0.0)) if among else 0.0
        if row is not None and among:
            longest = max(longest, float(row[among].max()))
        unseen = [c for c in self._searchable if c not in knowledge.first_seen and c in self._index]
        in_view = [c for c in unseen if c in self._in_passing]
        looks = unseen if not self._all_known(left, knowledge) else in_view
        fetches = min(self.max_picks, len(left))
        moves = len(looks) + 2 * fetches + walking
        return moves * longest + self._costs.search * len(looks) + 2 * fetches * self._costs.manipulation

    def _left_to_look(self, knowledge: Knowledge) -> list[int]:
        """Location indices of the containers that are not searched."""
        seen = knowledge.first_seen
        return [at for container, at in self._places if container not in seen]

    def _unmet_and_known(self, knowledge: Knowledge) -> tuple[tuple[Delivered | Holding, ...], bool]:
        """The parts of the goal that are not met, and whether nothing is missing for them; asked several times of a
        state."""
        last = self._last
        if last is None or last[0] is not knowledge:
            left = self._unmet_parts(knowledge)
            self._last = last = knowledge, left, self._all_known(left, knowledge)
        return last[1], last[2]

    def _unmet_parts(self, knowledge: Knowledge) -> tuple[Delivered | Holding, ...]:
        """The parts of the goal that are not met."""
        return tuple([part for part in self._parts if not is_met(part, knowledge)])

    def _all_known(self, left: tuple[Delivered | Holding, ...], knowledge: Knowledge) -> bool:
        types = {part.item_type for part in left}
        return self._one_way and all(self._known(t, knowledge) >= self._wanted[t] for t in types)

    def _known_route(self, left: tuple[Delivered | Holding, ...], knowledge: Knowledge) -> float | None:
        """The cost of the cheapest order of deliveries, each straight from where an instance stands; what is in hand
        is brought first. Nothing is missing. None where that is not what is left to do, or where the goal names a
        type twice: what was delivered of it is not to be fetched."""
        types = [part.item_type for part in left if isinstance(part, Delivered) and part.at in self._index]
        held, here = knowledge.holding, travel_row(knowledge, self._index, self._metres)
        if len(types) < len(left) or len(types) > MAX_ORDERED or here is None:
            return None
        if any(self._wanted[t] > 1 for t in types):
            return None
        if held is not None and held.type not in types:
            return None
        ends = [self._index[part.at] for part in left]
        stand = [self._usable_sites(part.item_type, knowledge) for part in left]
        in_hand = None if held is None else types.index(held.type)
        metres, handle = self._metres, self._costs.manipulation
        least = inf
        for order in permutations(range(len(left))):
            if in_hand is not None and order[0] != in_hand:
                continue
            cost, start = 0.0, here
            for part in order:
                end = ends[part]
                if part == in_hand:
                    cost += float(start[end]) + handle
                else:
                    cost += min(float(start[site] + metres[site, end]) for site in stand[part]) + 2 * handle
                start = metres[end]
            least = min(least, cost)
        return least

    def _nearest_legs(self, looks: tuple[int, ...], starts: tuple[int, ...]) -> float:
        """nearest_legs, cached for states that differ only in what was found where."""
        return self._into.get(
            (looks, starts), lambda: nearest_first_leg_bound(self._metres, list(looks), list(starts))
        )

    def _known(self, item_type: ItemType, knowledge: Knowledge) -> int:
        held = knowledge.holding is not None and knowledge.holding.type == item_type
        return held + len(self._usable_sites(item_type, knowledge))

    def _usable_sites(self, item_type: ItemType, knowledge: Knowledge) -> list[int]:
        """Where instances stand that can be fetched, once for each."""
        return [
            self._index[at]
            for at, item in knowledge.where(item_type)
            if at in self._index and at not in self._refused_moves and item.id not in self._refused_picks
        ]

    def _known_sites(self, part: Delivered | Holding, knowledge: Knowledge) -> list[int]:
        """Where an instance for a part is known to stand or is in hand; others may be in any container that is
        left."""
        held = knowledge.holding is not None and knowledge.holding.type == part.item_type
        places = [at for at, _ in knowledge.where(part.item_type)]
        places += [knowledge.robot_at] if held else []
        return list(dict.fromkeys(self._index[at] for at in places if at in self._index))


def nearest_first_leg_bound(metres: Floats, looks: list[int], starts: list[int]) -> float:
    """The most metres that looks can take if each goes to the nearest place left, in any number of runs of looks.

    Of two looks, the leg that leaves the earlier is no longer than the distance between them, since the later place
    was still left. So looks whose next leg is longer than t are more than t apart from one another, and lie in
    distinct clusters wherever no cluster is wider than t (complete linkage). Integrated over t, all legs that leave
    looks sum to at most the diameters of the merges plus the largest distance; legs from elsewhere are added, each to
    the farthest look. (Nearest-neighbour tours are bounded alike: Rosenkrantz, Stearns and Lewis, SIAM J. Comput. 6,
    1977.)

    Args:
        looks: indices of the places that are left.
        starts: indices of the other places from which a leg to a look can begin, each once.
    """
    if not looks:
        return 0.0
    from_elsewhere = float(metres.take(starts, axis=0).take(looks, axis=1).max(axis=1).sum())
    if len(looks) < 2:
        return from_elsewhere
    between = metres.take(looks, axis=0).take(looks, axis=1)
    widths = merge_widths(np.maximum(between, between.T))
    return from_elsewhere + float(widths[1:].sum() + widths[-1])  # no leg leaves the last look: not widths[0]


def _is_plain_delivery(goal: Goal) -> bool:
    """Whether there are only deliveries and finds: without preparation, each part needs one fetch."""
    return all(isinstance(leaf, Holding) or not leaf.properties for leaf in _leaves(goal))


def _has_alternatives(goal: Goal) -> bool:
    """Whether the goal has alternatives: then a strategy may seek one item though another is known."""
    if isinstance(goal, AllOf):
        return any(_has_alternatives(part) for part in goal.parts)
    return isinstance(goal, AnyOf)


def _leaves(goal: Goal) -> tuple[Delivered | Holding, ...]:
    if isinstance(goal, AllOf | AnyOf):
        return tuple(leaf for part in goal.parts for leaf in _leaves(part))
    return (goal,)
