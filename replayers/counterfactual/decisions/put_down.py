"""Whether a plan that puts something down on the way can be cheaper, whichever items are known; compiled with numba.

Such a plan fetches an item, puts it down somewhere, does something else, and comes back for it: two manipulations
more each time. It can begin an errand anywhere, and there an item may be the nearest that is the nearest from nowhere
else. By the triangle inequality no item is nearer from a place than from another less the distance between them. So
the distances from where other plans begin their errands bound those from everywhere. With these bounds, all plans
that put something down once or twice are compared, and the others are searched. What most of them fail by: the robot
carries one item at a time, so it walks at least as far as all of them are carried.
"""

# pyright: reportMissingTypeStubs=false, reportUntypedFunctionDecorator=false

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import pairwise, permutations, product
from typing import NamedTuple

import numpy as np

from workbench.arrays import Floats, Indices, Ints
from workbench.third_party.kernels import kernel

MAX_ITEMS = 3
"""With more items there are too many such plans."""

MAX_STATES = 5_000
"""Where a search would have to look at more states, a plan may be cheaper."""

WANTED = -1
"""In place of the number of a place to put something down: where the item is wanted."""
MAX_PLACES = 1 << 12
"""With more places, states have no number of their own."""
UNFETCHED, DELIVERED = -1, -2
"""In place of the place where an item was put down."""


class PutDownPlans(NamedTuple):
    """All plans that put something down once or twice, and orders of visits, by the number of items.

    Attributes:
        visits: of _visits, for one item, two and three.
        once, twice: of _errands, for two items and three.
    """

    visits: tuple[Indices, Indices, Indices, Indices, Indices, Indices]
    once: tuple[Indices, Indices, Indices, Indices]
    twice: tuple[Indices, Indices, Indices, Indices]


@cache
def put_down_plans() -> PutDownPlans:
    """The plans for up to MAX_ITEMS items."""
    return PutDownPlans(
        visits=(*_visits(1), *_visits(2), *_visits(3)),
        once=(*_errands(2, 1), *_errands(3, 1)),
        twice=(*_errands(2, 2), *_errands(3, 2)),
    )


@kernel(inline="always")
def may_put_down(
    metres: Floats,
    legs: Floats,
    begin: Indices,
    everywhere: Floats,
    manipulation: float,
    straight: float,
    plans: PutDownPlans,
) -> bool:
    """Whether a plan that puts something down on the way may be cheaper than all straight ones.

    Args:
        metres: between all places, shape (places, places); a symmetric metric.
        legs: the least metres to an item and on to where it is wanted, from where the robot is and from where each of
            the items is wanted; shape (items + 1, items).
        begin: these places, shape (items + 1,).
        everywhere: lower bounds on the metres from every place to an item and on to where it is wanted, shape (items,
            places).
        manipulation: the cost of a pick or a place.
        straight: what the cheapest straight plan costs without its picks and places.
        plans: of put_down_plans.
    """
    items, places, again = legs.shape[1], len(metres), 2 * manipulation
    if items > MAX_ITEMS or places > MAX_PLACES - 3:
        return True
    if items < 2:
        return False
    ends, errands, carried = begin[1:], np.empty((items, places)), np.full(items, np.inf)
    for item in range(items):
        for place in range(places):
            least = max(metres[ends[item], place], everywhere[item, place])
            for b in range(items + 1):
                least = max(least, legs[b, item] - metres[begin[b], place])
            errands[item, place] = least
        for b in range(items + 1):
            errands[item, begin[b]] = legs[b, item]
        for place in range(places):
            carried[item] = min(carried[item], errands[item, place])
    here, at = int(begin[0]), np.full(items, UNFETCHED)
    least = max(
        _least_metres(here, at, metres, errands, ends, plans.visits),
        _farthest_or_carried(here, at, metres, errands, carried, ends),
    )
    if least + again >= straight:
        return False
    of, to = (plans.once[0], plans.once[1]) if items == 2 else (plans.once[2], plans.once[3])
    if _is_cheaper(metres, errands, begin, of, to, straight - again):
        return True
    if least + 2 * again >= straight:
        return False
    of, to = (plans.twice[0], plans.twice[1]) if items == 2 else (plans.twice[2], plans.twice[3])
    if _is_cheaper(metres, errands, begin, of, to, straight - 2 * again):
        return True
    if least + 3 * again >= straight:
        return False
    return _may_be_cheaper(metres, errands, carried, begin, again, straight, plans.visits)


def _errands(items: int, times: int) -> tuple[Indices, Indices]:
    """All plans that put something down so many times: the item of each errand, and the number of the place where it
    ends up; both of shape (plans, items + times). None fetches the same item twice running."""
    plans = list(_plans(items, times))
    of, to = ([[part[k] for part in plan] for plan in plans] for k in (0, 1))
    return np.array(of, dtype=np.intp), np.array(to, dtype=np.intp)


def _plans(items: int, times: int) -> Iterator[tuple[tuple[int, int], ...]]:
    for put_down in product(range(items), repeat=times):
        if list(put_down) != sorted(put_down):
            continue
        stages = {item: [k for k, one in enumerate(put_down) if one == item] for item in range(items)}
        errands = [item for item in range(items) for _ in range(len(stages[item]) + 1)]
        for order in sorted(set(permutations(errands))):
            if any(a == b for a, b in pairwise(order)):
                continue
            left = {item: iter((*stages[item], WANTED)) for item in range(items)}
            yield tuple((item, next(left[item])) for item in order)


def _visits(items: int) -> tuple[Indices, Indices]:
    """Orders in which the places are visited where things are wanted, shape (orders, items); and in which stretch of
    such a walk each of them, in that order, is picked up: not after its place, shape (choices, items)."""
    picked = list(product(*(range(i + 1) for i in range(items))))
    return np.array(list(permutations(range(items))), dtype=np.intp), np.array(picked, dtype=np.intp)


@kernel()
def _is_cheaper(metres: Floats, errands: Floats, begin: Indices, of: Indices, to: Indices, limit: float) -> bool:
    """Whether a plan of certain errands takes fewer metres than a limit, with things put down anywhere.

    Args:
        errands: lower bounds on the metres from each place to an item and on to where it is wanted, shape (items,
            places).
        of, to: as of _errands.
    """
    items, places = errands.shape
    count = of.shape[1]
    stood, before = np.empty(items, np.int64), np.empty(count, np.int64)
    at, option, spent = np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count)
    for plan in range(len(of)):
        for item in range(items):
            stood[item] = -1
        errand, at[0], option[0], spent[0] = 0, begin[0], 0, 0.0
        while errand >= 0:  # depth first over the places where things are put down
            item, stage = of[plan, errand], to[plan, errand]
            if option[errand] == (1 if stage < 0 else places):
                errand -= 1
                if errand >= 0:
                    stood[of[plan, errand]] = before[errand]
                continue
            end = begin[item + 1] if stage < 0 else option[errand]
            option[errand] += 1
            here, was = at[errand], stood[item]
            if was >= 0:
                cost = spent[errand] + (metres[here, was] + metres[was, end])
            else:
                cost = spent[errand] + max(metres[here, end], errands[item, here] - metres[end, begin[item + 1]])
            if cost >= limit:
                continue
            if errand == count - 1:
                return True
            before[errand], stood[item] = was, end
            errand += 1
            at[errand], option[errand], spent[errand] = end, 0, cost
    return False


@kernel()
def _least_metres(
    here: int, at: Ints, metres: Floats, errands: Floats, ends: Indices, visits: tuple[Indices, ...]
) -> float:
    """A lower bound on the metres to bring all items that are left: those of a robot that carries any number.

    Args:
        at: where each item was put down, or UNFETCHED, or DELIVERED.
        visits: of _visits, for one item, two and three.
    """
    left = _left(at)
    count = len(left)
    orders = visits[0] if count == 1 else visits[2] if count == 2 else visits[4]
    picked = visits[1] if count == 1 else visits[3] if count == 2 else visits[5]
    best = np.inf
    for order in orders:
        for stretches in picked:
            total, begin = 0.0, here
            for stretch in range(count):
                end = int(ends[left[order[stretch]]])
                least = metres[begin, end]
                for other in range(stretch, count):
                    if stretches[other] == stretch:
                        item = int(left[order[other]])
                        way = _way(begin, item, at, metres, errands, ends)
                        least = max(least, way - metres[ends[item], end])
                total += least
                begin = end
            best = min(best, total)
    return best


@kernel()
def _left(at: Ints) -> Ints:
    """The items that are not delivered yet. (Kernels with np.flatnonzero, np.all and the like load all that numba has
    for arrays, and scipy.linalg with it.)"""
    items, count = np.empty(len(at), np.int64), 0
    for item in range(len(at)):
        if at[item] != DELIVERED:
            items[count] = item
            count += 1
    return items[:count]


@kernel()
def _way(begin: int, item: int, at: Ints, metres: Floats, errands: Floats, ends: Indices) -> float:
    """A lower bound on the metres from a place to an item and on to where it is wanted."""
    if at[item] == UNFETCHED:
        return errands[item, begin]
    return metres[begin, at[item]] + metres[at[item], ends[item]]


@kernel()
def _farthest_or_carried(
    here: int, at: Ints, metres: Floats, errands: Floats, carried: Floats, ends: Indices
) -> float:
    """A lower bound on the metres to bring all items that are left: by the farthest, and by all with one in hand."""
    farthest, in_hand = 0.0, 0.0
    for item in range(len(at)):
        if at[item] != DELIVERED:
            farthest = max(farthest, _way(here, item, at, metres, errands, ends))
            in_hand += float(carried[item] if at[item] == UNFETCHED else metres[at[item], ends[item]])
    return max(farthest, in_hand)


@kernel()
def _is_new(robot: int, at: Ints, last: int, owed: int, spent: float, known: Ints, costs: Floats) -> bool:
    """Whether a state was not reached before at this cost or less; notes it in a hash table (open addressing)."""
    code = ((last + 1) * (MAX_ITEMS + 1) + owed) * MAX_PLACES + robot
    for place in at:
        code = code * MAX_PLACES + place + 2
    row = code * np.int64(-7046029254386353131) % len(known)
    for _ in range(len(known)):
        if known[row] == code:
            if costs[row] <= spent:
                return False
            break
        if known[row] < 0:
            break
        row = (row + 1) % len(known)
    known[row], costs[row] = code, spent
    return True


@kernel()
def _may_be_cheaper(
    metres: Floats,
    errands: Floats,
    carried: Floats,
    begin: Indices,
    again: float,
    straight: float,
    visits: tuple[Indices, ...],
) -> bool:
    """Whether a plan that puts something down three times or more may be cheaper, by a depth-first search.

    Args:
        carried: lower bounds on the metres from an item to where it is wanted, shape (items,).
    """
    items, places = errands.shape
    ends = begin[1:]
    at, now = np.full((MAX_STATES + 1, items), UNFETCHED), np.empty(items, np.int64)
    robot, spent = np.full(MAX_STATES + 1, begin[0]), np.zeros(MAX_STATES + 1)
    last, owed = np.full(MAX_STATES + 1, -1), np.full(MAX_STATES + 1, 3)
    known, costs = np.full(4 * MAX_STATES, -1), np.zeros(4 * MAX_STATES)
    waiting, found = 1, 0
    while waiting:
        waiting -= 1
        now[:] = at[waiting]
        here, cost, before, must = robot[waiting], spent[waiting], last[waiting], owed[waiting]
        for item in range(items):
            was = now[item]
            if was == DELIVERED or item == before:
                continue
            for place in range(WANTED, places):
                end = ends[item] if place < 0 else place
                if place == ends[item] or (place >= 0 and place == was):
                    continue
                if was == UNFETCHED:
                    leg = max(metres[here, end], errands[item, here] - metres[end, ends[item]])
                else:
                    leg = metres[here, was] + metres[was, end]
                spend = cost + leg + (0.0 if place < 0 else again)
                still = must if place < 0 else max(must - 1, 0)
                least = spend + still * again
                now[item] = DELIVERED if place < 0 else place
                if not len(_left(now)):
                    if still == 0 and least < straight:
                        return True
                    now[item] = was
                    continue
                left = _farthest_or_carried(end, now, metres, errands, carried, ends)
                if least + left < straight:
                    left = _least_metres(end, now, metres, errands, ends, visits)
                put = -1 if place < 0 else item
                if least + left < straight and _is_new(end, now, put, still, spend, known, costs):
                    found += 1
                    if found > MAX_STATES:
                        return True
                    at[waiting] = now
                    robot[waiting], spent[waiting], last[waiting], owed[waiting] = end, spend, put, still
                    waiting += 1
                now[item] = was
    return False
