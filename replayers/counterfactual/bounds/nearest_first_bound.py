"""An upper bound on the remaining cost of a strategy that looks into the nearest container first, over all ways in
which errands can interrupt its looks.

Between two errands such a strategy goes from container to container, always to the nearest one left: where it stands
and what is left decide the whole chain. Only an errand (fetch a found item, bring it to where the goal wants it)
takes it elsewhere, and each part of the goal takes one errand at most. So every run is a few chains with an errand
between one and the next, and there are few enough of them to try them all: each length of each chain, each part, and
of the places where its item may have been found so far the one that makes the errand longest. What the log shows, and
what must exist by the inventory, ends a chain: the robot looks only while something is missing.

The order of errands and the contents of open containers are left open, so no consistent world and no choice of the
planner exceeds the bound. Compiled with numba.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

from itertools import permutations
from typing import NamedTuple, final

import numpy as np

from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.relevance import Relevance
from workbench.arrays import Bools, Floats, Ints
from workbench.execution.goal_check import is_met
from workbench.planning.tasks import distinct_deliveries
from workbench.third_party.kernels import kernel
from workbench.tolerances import MIN_SCALE, RELATIVE
from workbench.worlds.house import LocationId
from workbench.worlds.knowledge import Knowledge

MAX_PARTS = 3
"""With more parts of the goal left, there are too many ways of interrupting the looks."""

NO_BOUND = float("inf")


class _Errands(NamedTuple):
    """One state as arrays: the parts of the goal that are left, and the containers that are not searched.

    Attributes:
        metres: between all locations, shape (locations, locations).
        robot: location index.
        containers: location indices in the plan's order, shape (n,).
        unseen: whether a container's contents are unknown, shape (n,).
        shown: whether the log shows a part's item in it, shape (parts, n).
        may: whether a part's item may be found in it, shape (parts, n).
        targets: location indices, shape (parts,).
        standing: location indices of known instances, padded with -1, shape (parts, any).
        missing: whether no instance of a part's item is known, shape (parts,).
        exists: whether an unseen container holds one, shape (parts,).
        orders: all orders of the parts, shape (orders, parts).
        look, handle: action costs.
    """

    metres: Floats
    robot: int
    containers: Ints
    unseen: Bools
    shown: Bools
    may: Bools
    targets: Ints
    standing: Ints
    missing: Bools
    exists: Bools
    orders: Ints
    look: float
    handle: float


@final
class NearestFirstBound:
    """The bound for one log and one task: deliveries of different types, as they are, by a robot whose actions
    succeed; infinite for all others."""

    def __init__(self, evidence: Evidence, relevance: Relevance) -> None:
        travel = evidence.place.travel
        self._metres: Floats = np.ascontiguousarray(travel.metres)
        self._index = {name: i for i, name in enumerate(travel.locations)}
        self._costs = evidence.costs
        self._open = frozenset(evidence.open)
        self._shown = {c: frozenset(item.type for item in items) for c, items in evidence.contents.items()}
        self._parts = distinct_deliveries(evidence.task.goal)
        refused = evidence.refused_moves or evidence.refused_picks or evidence.refused_searches
        self._applies = bool(self._parts) and not refused and not evidence.misses and evidence.passing is None
        seen = evidence.seen_types()
        self._may = frozenset(t for t in relevance.types if not (relevance.unique and t in seen))
        self._exist = frozenset() if relevance.hidden else relevance.must_exist - seen

    def remaining_cost(self, knowledge: Knowledge) -> float:
        """The upper bound on the remaining cost from a state on, if the task gets done; infinite where it does not
        apply."""
        if not self._applies or knowledge.holding is not None or knowledge.closed or knowledge.again:
            return NO_BOUND
        left = [part for part in self._parts if not is_met(part, knowledge)]
        places = [c for c in knowledge.unsearched if c in self._open or c in self._shown]
        wanted = {knowledge.robot_at, *(part.at for part in left)}
        unknown = len(places) < len(knowledge.unsearched) or any(at not in self._index for at in wanted)
        if unknown or len(left) > MAX_PARTS:
            return NO_BOUND
        standing = [[self._index[at] for at, _ in knowledge.where(p.item_type) if at in self._index] for p in left]
        if all(standing):
            return NO_BOUND
        widest = max(map(len, standing))
        nowhere = frozenset[str]()
        shown = [[part.item_type in self._shown.get(c, nowhere) for c in places] for part in left]
        may = [
            [there or (c in self._open and part.item_type in self._may) for c, there in zip(places, row, strict=True)]
            for part, row in zip(left, shown, strict=True)
        ]
        size = (len(left), len(places))
        return _most(
            _Errands(
                metres=self._metres,
                robot=self._index[knowledge.robot_at],
                containers=np.array([self._index[LocationId(c)] for c in places], dtype=np.int64),
                unseen=np.array([c in self._open for c in places], dtype=np.bool_),
                shown=np.array(shown, dtype=np.bool_).reshape(size),
                may=np.array(may, dtype=np.bool_).reshape(size),
                targets=np.array([self._index[part.at] for part in left], dtype=np.int64),
                standing=np.array([at + [-1] * (widest - len(at)) for at in standing], dtype=np.int64).reshape(
                    len(left), widest
                ),
                missing=np.array([not at for at in standing], dtype=np.bool_),
                exists=np.array([part.item_type in self._exist for part in left], dtype=np.bool_),
                orders=np.array(list(permutations(range(len(left)))), dtype=np.int64),
                look=float(self._costs.search),
                handle=float(self._costs.manipulation),
            )
        )


@kernel()
def _most(state: _Errands) -> float:
    """The cost of the most expensive run: depth first over the parts that errands bring while something is missing,
    one level for each chain of looks."""
    parts, n = state.may.shape
    gone = np.zeros((parts + 1, n), np.bool_)
    chain = np.zeros((parts + 1, n), np.int64)
    spent = np.zeros((parts + 1, n + 1))
    length, walked = np.zeros(parts + 1, np.int64), np.zeros(parts + 1, np.int64)
    part, brought = np.zeros(parts + 1, np.int64), np.zeros(parts + 1, np.int64)
    begin = np.zeros(parts + 1, np.int64)
    begin[0] = state.robot
    length[0] = _chain(state, state.robot, brought[0], gone[0].copy(), chain[0], spent[0])
    level, most = 0, 0.0
    while level >= 0:
        k, p = walked[level], part[level]
        if k > length[level]:
            level -= 1
            continue
        if p == 0:
            most = max(most, spent[level, k])
            if k > 0:
                last = chain[level, k - 1]
                gone[level, last] = True
                most = max(most, spent[level, k] + _last_errands(state, last, brought[level], gone[level]))
        part[level] += 1
        if p == parts:
            walked[level] += 1
            part[level] = 0
            continue
        if brought[level] >> p & 1 or not _may_be_missing(state, brought[level] | 1 << p, gone[level]):
            continue
        at = int(begin[level] if k == 0 else state.containers[chain[level, k - 1]])
        errand = _errand(state, p, at, gone[level])
        if errand < 0:
            continue
        level += 1
        brought[level] = brought[level - 1] | 1 << p
        for c in range(n):
            gone[level, c] = gone[level - 1, c]
        begin[level] = state.targets[p]
        spent[level, 0] = spent[level - 1, k] + errand
        walked[level], part[level] = 0, 0
        length[level] = _chain(state, begin[level], brought[level], gone[level].copy(), chain[level], spent[level])
    return most


@kernel()
def _last_errands(state: _Errands, last: int, brought: int, gone: Bools) -> float:
    """The largest remaining cost once a look into container `last` shows the last missing item; 0 where it cannot."""
    most, place = 0.0, int(state.containers[last])
    for found in range(len(state.targets)):
        if brought >> found & 1 or not state.missing[found] or not state.may[found, last]:
            continue
        least = np.inf
        for order in state.orders:
            cost, at = 0.0, place
            for p in order:
                if brought >> p & 1:
                    continue
                if p == found:
                    errand = -1.0
                    if place != state.targets[p]:
                        errand = state.metres[at, place] + state.metres[place, state.targets[p]] + 2.0 * state.handle
                else:
                    errand = _errand(state, p, at, gone)
                if errand >= 0:  # otherwise it stands where it is wanted, or is still missing
                    cost += errand
                    at = int(state.targets[p])
            least = min(least, float(cost))
        most = max(most, least)
    return most


@kernel()
def _errand(state: _Errands, part: int, at: int, gone: Bools) -> float:
    """The longest errand that a part may take from a location on; -1 where its item cannot have been found, except
    where it is wanted. Of instances that are known, a shortest plan takes the one that makes the errand shortest."""
    longest, shortest, target = -1.0, np.inf, state.targets[part]
    for place in state.standing[part]:
        if place >= 0:
            shortest = min(shortest, state.metres[at, place] + state.metres[place, target])
    if shortest < np.inf:
        return float(shortest + 2.0 * state.handle)
    for c in range(len(gone)):
        place = state.containers[c]
        if gone[c] and state.may[part, c] and place != target:
            longest = max(longest, state.metres[at, place] + state.metres[place, target])
    return longest + 2.0 * state.handle if longest >= 0 else -1.0


@kernel()
def _chain(state: _Errands, at: int, brought: int, gone: Bools, chain: Ints, spent: Floats) -> int:
    """The looks from a location on, for as long as something may be missing; fills the containers, and what has been
    spent after each (spent[0] is given). Overwrites `gone`.

    Returns:
        The number of looks.
    """
    length = 0
    while _may_be_missing(state, brought, gone):
        least = np.inf
        for c in range(len(gone)):
            if not gone[c]:
                least = min(least, state.metres[at, state.containers[c]])
        if least == np.inf:
            break
        most = least + RELATIVE * max(MIN_SCALE, least)
        for c in range(len(gone)):
            if not gone[c] and state.metres[at, state.containers[c]] <= most:
                spent[length + 1] = spent[length] + state.metres[at, state.containers[c]] + state.look
                chain[length] = c
                gone[c] = True
                at = state.containers[c]
                break
        length += 1
    return length


@kernel()
def _may_be_missing(state: _Errands, brought: int, gone: Bools) -> bool:
    """Whether the item of some part may still be missing after looks into those containers."""
    unseen_left = False
    for c in range(len(gone)):
        unseen_left |= state.unseen[c] and not gone[c]
    for p in range(len(state.targets)):
        if brought >> p & 1 or not state.missing[p] or (state.exists[p] and not unseen_left):
            continue
        found = False
        for c in range(len(gone)):
            found |= gone[c] and state.shown[p, c]
        if not found:
            return True
    return False
