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
from workbench.caches import Cache
from workbench.execution.goal_check import is_met
from workbench.planning.tasks import Delivered, distinct_deliveries
from workbench.third_party.kernels import kernel
from workbench.tolerances import MIN_SCALE, RELATIVE
from workbench.worlds.house import LocationId
from workbench.worlds.knowledge import Knowledge

MAX_PARTS = 3
"""With more parts of the goal left, there are too many ways of interrupting the looks."""

MAX_CACHED_PARTS = 64
"""Sets of parts that are left."""

NO_BOUND = float("inf")

NOTHING = -1


class Errands(NamedTuple):
    """One state as arrays: the parts of the goal that are left, and the containers that are not searched.

    Sets of parts are bit masks.

    Attributes:
        metres: between all locations, shape (locations, locations).
        robot: location index.
        containers: location indices in the plan's order, shape (n,).
        unseen: whether a container's contents are unknown, shape (n,).
        shown: the parts whose item the log shows in it, shape (n,).
        may: whether a part's item may be found in it, shape (parts, n).
        targets: location indices, shape (parts,).
        standing: location indices of known instances, padded with -1, shape (parts, any).
        missing: the parts of whose item no instance is known.
        exists: the parts whose item an unseen container holds.
        orders: all orders of the parts, shape (orders, parts).
        look, handle: action costs.
    """

    metres: Floats
    robot: int
    containers: Ints
    unseen: Bools
    shown: Ints
    may: Bools
    targets: Ints
    standing: Ints
    missing: int
    exists: int
    orders: Ints
    look: float
    handle: float


class _Runs(NamedTuple):
    """Scratch of the search, which has a level for each chain of looks.

    Attributes:
        gone: the containers that were looked into, shape (levels, n).
        chain, spent: the containers of the chain, in order, and what was spent up to each, shape (levels, n + 1).
        length: the looks in the chain; walked: those made; part: the part of the next errand; all of shape (levels,).
        begin: the location index at which the chain begins; brought: the parts brought before; shown, unseen: the
            parts whose items the looks made show, and how many unseen containers are left; all of shape (levels,).
        rest: the containers that the chain at work has not come to, shape (n,).
    """

    gone: Bools
    chain: Ints
    spent: Floats
    length: Ints
    walked: Ints
    part: Ints
    begin: Ints
    brought: Ints
    shown: Ints
    unseen: Ints
    rest: Bools


class _Parts(NamedTuple):
    """What is the same in all states with the same parts left: as of Errands, but over all containers of the log."""

    shown: Ints
    may: Bools
    targets: Ints
    exists: int
    orders: Ints


@final
class NearestFirstBound:
    """The bound for one log and one task: deliveries of different types, as they are, by a robot whose actions
    succeed; infinite for all others.

    Attributes:
        metres: as of Errands. column: the containers, each with its place in these arrays.
        at, unseen, shown, may: as of Errands, over all containers and parts; shown has shape (parts, n).
        exist: types of which an unseen container holds an instance.
    """

    def __init__(self, evidence: Evidence, relevance: Relevance) -> None:
        travel = evidence.place.travel
        self.metres: Floats = np.ascontiguousarray(travel.metres)
        self._index = {name: i for i, name in enumerate(travel.locations)}
        self._costs = evidence.costs
        self._parts = distinct_deliveries(evidence.task.goal)
        refused = evidence.refused_moves or evidence.refused_picks or evidence.refused_searches
        self._applies = bool(self._parts) and not refused and not evidence.misses and evidence.passing is None
        seen, types = evidence.seen_types(), [part.item_type for part in self._parts]
        may = [t in relevance.types and not (relevance.unique and t in seen) for t in types]
        self.exist = frozenset() if relevance.hidden else relevance.must_exist - seen
        known = {c: {item.type for item in items} for c, items in evidence.contents.items()}
        listed = [c for c in dict.fromkeys((*known, *evidence.open)) if LocationId(c) in self._index]
        self._arrays: Cache[tuple[Delivered, ...], _Parts] = Cache(MAX_CACHED_PARTS)
        self.column = {c: i for i, c in enumerate(listed)}
        self.at = np.array([self._index[LocationId(c)] for c in listed], dtype=np.int64)
        self.unseen = np.array([c in frozenset(evidence.open) for c in listed], dtype=np.bool_)
        there = [[t in known.get(c, ()) for c in listed] for t in types]
        self.shown = np.array(there, dtype=np.bool_).reshape(len(types), len(listed))
        self.may = self.shown | (self.unseen & np.array(may, dtype=np.bool_)[:, None])

    def remaining_cost(self, knowledge: Knowledge) -> float:
        """The upper bound on the remaining cost from a state on, if the task gets done; infinite where it does not
        apply."""
        if not self._applies or knowledge.holding is not None or knowledge.closed or knowledge.again:
            return NO_BOUND
        left, index = tuple([part for part in self._parts if not is_met(part, knowledge)]), self._index
        standing = [[index[at] for at, _ in knowledge.where(part.item_type) if at in index] for part in left]
        if all(standing) or len(left) > MAX_PARTS:
            return NO_BOUND
        columns = [self.column.get(c, -1) for c in knowledge.unsearched]
        if -1 in columns or not {knowledge.robot_at, *[part.at for part in left]} <= index.keys():
            return NO_BOUND
        widest, places = max(map(len, standing)), np.array(columns, dtype=np.int64)
        one = self._arrays.get(left, lambda: self._arrays_of(left))
        state = Errands(
            metres=self.metres,
            robot=index[knowledge.robot_at],
            containers=self.at[places],
            unseen=self.unseen[places],
            shown=one.shown[places],
            may=one.may.take(places, axis=1),
            targets=one.targets,
            standing=np.array([[*at, *[-1] * (widest - len(at))] for at in standing], dtype=np.int64),
            missing=sum(1 << p for p, at in enumerate(standing) if not at),
            exists=one.exists,
            orders=one.orders,
            look=float(self._costs.search),
            handle=float(self._costs.manipulation),
        )
        return most_of(state)

    def _arrays_of(self, left: tuple[Delivered, ...]) -> _Parts:
        rows = [self._parts.index(part) for part in left]
        return _Parts(
            shown=(1 << np.arange(len(rows))) @ self.shown[rows],
            may=self.may[rows],
            targets=np.array([self._index[part.at] for part in left], dtype=np.int64),
            exists=sum(1 << p for p, part in enumerate(left) if part.item_type in self.exist),
            orders=np.array(list(permutations(range(len(left)))), dtype=np.int64),
        )


@kernel()
def most_of(state: Errands) -> float:
    """The cost of the most expensive run."""
    parts, n = state.may.shape
    runs = _Runs(
        gone=np.zeros((parts + 1, n), np.bool_),
        chain=np.zeros((parts + 1, n + 1), np.int64),
        spent=np.zeros((parts + 1, n + 1)),
        length=np.zeros(parts + 1, np.int64),
        walked=np.zeros(parts + 1, np.int64),
        part=np.zeros(parts + 1, np.int64),
        begin=np.zeros(parts + 1, np.int64),
        brought=np.zeros(parts + 1, np.int64),
        shown=np.zeros(parts + 1, np.int64),
        unseen=np.zeros(parts + 1, np.int64),
        rest=np.zeros(n, np.bool_),
    )
    return _most_in(state, runs)


@kernel(borrows=True)
def _most_in(state: Errands, runs: _Runs) -> float:
    """The same, depth first over the parts that errands bring while something is missing, one level for each chain of
    looks."""
    parts, n = state.may.shape
    for c in range(n):
        runs.unseen[0] += state.unseen[c]
    runs.begin[0] = state.robot
    runs.length[0] = _chain(state, runs, 0)
    level, most = 0, 0.0
    while level >= 0:
        k, p = runs.walked[level], runs.part[level]
        if k > runs.length[level]:
            level -= 1
            continue
        last = runs.chain[level, k - 1] if k > 0 else NOTHING
        if p == 0:
            most = max(most, runs.spent[level, k])
            if k > 0:
                runs.gone[level, last] = True
                runs.shown[level] |= state.shown[last]
                runs.unseen[level] -= state.unseen[last]
                errands = _last_errands(state, last, runs.brought[level], runs.gone[level])
                most = max(most, runs.spent[level, k] + errands)
        runs.part[level] += 1
        if p == parts:
            runs.walked[level], runs.part[level] = k + 1, 0
            continue
        brought = runs.brought[level] | 1 << p
        taken = brought == runs.brought[level]
        if taken or not _may_be_missing(state, brought, runs.shown[level], runs.unseen[level]):
            continue
        at = runs.begin[level] if k == 0 else state.containers[last]
        errand = _errand(state, p, at, runs.gone[level])
        if errand >= 0:
            level += 1
            for c in range(n):
                runs.gone[level, c] = runs.gone[level - 1, c]
            runs.shown[level], runs.unseen[level] = runs.shown[level - 1], runs.unseen[level - 1]
            runs.brought[level], runs.begin[level] = brought, state.targets[p]
            runs.walked[level], runs.part[level] = 0, 0
            runs.spent[level, 0] = runs.spent[level - 1, k] + errand
            runs.length[level] = _chain(state, runs, level)
    return most


@kernel(borrows=True)
def _last_errands(state: Errands, last: int, brought: int, gone: Bools) -> float:
    """The largest remaining cost once a look into container `last` shows the last missing item; 0 where it cannot."""
    most, place = 0.0, int(state.containers[last])
    for found in range(len(state.targets)):
        if brought >> found & 1 or not state.missing >> found & 1 or not state.may[found, last]:
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


@kernel(borrows=True)
def _errand(state: Errands, part: int, at: int, gone: Bools) -> float:
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


@kernel(borrows=True)
def _chain(state: Errands, runs: _Runs, level: int) -> int:
    """The looks of a level, for as long as something may be missing; fills the containers, and what has been spent
    after each (spent[0] is given).

    Returns:
        The number of looks.
    """
    chain, spent, rest = runs.chain[level], runs.spent[level], runs.rest
    shown, unseen, at = runs.shown[level], runs.unseen[level], runs.begin[level]
    for c in range(len(rest)):
        rest[c] = not runs.gone[level, c]
    length = 0
    while _may_be_missing(state, runs.brought[level], shown, unseen):
        least = np.inf
        for c in range(len(rest)):
            if rest[c]:
                least = min(least, state.metres[at, state.containers[c]])
        if least == np.inf:
            break
        most, nearest = least + RELATIVE * max(MIN_SCALE, least), 0
        while not rest[nearest] or state.metres[at, state.containers[nearest]] > most:
            nearest += 1
        spent[length + 1] = spent[length] + state.metres[at, state.containers[nearest]] + state.look
        chain[length] = nearest
        rest[nearest] = False
        shown |= state.shown[nearest]
        unseen -= state.unseen[nearest]
        at = state.containers[nearest]
        length += 1
    return length


@kernel(inline="always", borrows=True)
def _may_be_missing(state: Errands, brought: int, shown: int, unseen: int) -> bool:
    """Whether the item of some part may still be missing after looks that show those parts and leave so many unseen
    containers."""
    left = state.missing & ~brought & ~shown
    return (left if unseen > 0 else left & ~state.exists) != 0
