"""Whether one plan of deliveries is the best, whichever items are known that are not needed; compiled with numba.

The test of NeededItems.one_plan_is_best (needed_items.py), which says why it is asked.
"""

# pyright: reportMissingTypeStubs=false, reportUntypedFunctionDecorator=false

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from replayers.counterfactual.decisions.put_down import MAX_ITEMS, PutDownPlans, may_put_down
from workbench.arrays import Bools, Floats, Indices, Ints
from workbench.third_party.kernels import kernel
from workbench.tolerances import NEAR_COST


class OnePlanRules(NamedTuple):
    """What the test goes by for one log and one task.

    Attributes:
        metres: between all places, shape (places, places).
        errands: from each place by each place to where a part is wanted, shape (parts, places, places).
        wanted: where each part is wanted, shape (parts,).
        manipulation: the cost of a pick or a place.
        any_first: where the strategy looks does not depend on what it seeks.
        plans: that put things down.
    """

    metres: Floats
    errands: Floats
    wanted: Ints
    manipulation: float
    any_first: bool
    plans: PutDownPlans


@kernel()
def one_plan_is_best(rules: OnePlanRules, here: int, at: Ints, left: Indices, looked: Indices) -> bool:
    """Whether all plans of least cost do the same until they see something new, or to their ends, and none that puts
    something down on the way is cheaper.

    Args:
        here: where the robot stands, with an empty hand.
        at: where the known items of each part's type are, padded with -1, shape (parts, items).
        left: where the containers are that are left.
        looked: where the containers are that nobody opened and this run looked into.
    """
    unmet, some_missing, some_unknown = parts_left(at, rules.wanted), False, False
    for p in range(len(at)):
        some_unknown |= at[p, 0] < 0
    for p in unmet:
        some_missing |= at[p, 0] < 0
    if len(unmet) < 2 or (some_missing and not len(left)) or not len(looked):
        return True
    if len(unmet) > MAX_ITEMS:
        return False
    begin = np.empty(len(unmet) + 1, np.intp)
    begin[0] = here
    for i in range(len(unmet)):
        begin[i + 1] = rules.wanted[unmet[i]]
    legs, missing = np.full((len(begin), len(unmet)), np.inf), np.zeros(len(unmet), np.bool_)
    everywhere = np.empty((len(unmet), len(rules.metres)))
    for i in range(len(unmet)):
        p = unmet[i]
        missing[i] = at[p, 0] < 0
        for b in range(len(begin)):
            legs[b, i] = _least(rules.errands[p, begin[b]], left if missing[i] else at[p])
        fill_everywhere(everywhere[i], rules, p, here, at[p], left, looked, some_unknown)
    best, second = _two_beginnings(legs, missing, rules.any_first)
    if may_put_down(rules.metres, legs, begin, everywhere, rules.manipulation, best, rules.plans):
        return False
    return not some_missing or second - best > NEAR_COST * max(1.0, best)


@kernel()
def parts_left(at: Ints, wanted: Ints) -> Ints:
    """The parts that are not met.

    Args:
        at: where the known items of each part's type are, padded with -1, shape (parts, items).
        wanted: where each part is wanted, shape (parts,).
    """
    unmet, count = np.empty(len(wanted), np.int64), 0
    for p in range(len(wanted)):
        is_met = False
        for place in at[p]:
            is_met |= place == wanted[p]
        if not is_met:
            unmet[count] = p
            count += 1
    return unmet[:count]


@kernel()
def _least(row: Floats, places: Ints) -> float:
    """The least of a row at some places; those below 0 are none."""
    least = np.inf
    for place in places:
        if place >= 0:
            least = min(least, float(row[place]))
    return least


@kernel()
def fill_everywhere(
    row: Floats,
    rules: OnePlanRules,
    part: int,
    here: int,
    known: Ints,
    left: Indices,
    looked: Indices,
    some_unknown: bool,
) -> None:
    """Lower bounds on the metres from each place to an item and on to where it is wanted, whichever items are known
    that are not needed: they are where the log shows them, or in open containers where this run looked, and there not
    nearer than the needed ones from where they would be needed."""
    errands = rules.errands[part]
    if known[0] < 0:
        for place in range(len(row)):
            row[place] = _least(errands[place], left)
        return
    for place in range(len(row)):
        row[place] = _least(errands[place], known)
    for other in looked:
        nearer = _is_nearer(errands[here], known, other)
        for place in rules.wanted:
            nearer |= _is_nearer(errands[place], known, other)
        if some_unknown:
            for place in left:
                nearer |= _is_nearer(errands[place], known, other)
        if not nearer:
            for place in range(len(row)):
                row[place] = min(row[place], errands[place, other])


@kernel()
def _is_nearer(row: Floats, known: Ints, other: int) -> bool:
    """Whether another place is clearly nearer than all known items."""
    nearest = _least(row, known)
    return row[other] < nearest - NEAR_COST * max(1.0, nearest)


@kernel()
def _two_beginnings(legs: Floats, missing: Bools, any_first: bool) -> tuple[float, float]:
    """The least cost of all plans, and that of those which begin otherwise, up to the first look; infinite without
    any."""
    items = legs.shape[1]
    count = 2 if items == 2 else 6
    costs, codes = np.empty(count), np.empty(count, np.int64)
    order = np.empty(items, np.int64)
    for p in range(count):
        order[0] = p % items
        rest, turned = (order[0] + 1) % items, p >= items
        for k in range(1, items):
            order[k] = (rest + k - 1) % items
        if turned and items == 3:
            order[1], order[2] = order[2], order[1]
        cost, code, is_looking, robot = 0.0, 1, False, 0
        for i in order:
            cost += legs[robot, i]
            robot = i + 1
            if not is_looking and not (missing[i] and any_first):
                code = code * (MAX_ITEMS + 1) + i
            is_looking |= missing[i]
        costs[p], codes[p] = cost, code
    best, second = 0, np.inf
    for p in range(count):
        best = p if costs[p] < costs[best] else best
    for p in range(count):
        if codes[p] != codes[best]:
            second = min(second, costs[p])
    return costs[best], second
