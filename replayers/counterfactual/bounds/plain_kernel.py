"""The bounds of one state of a plain delivery at once, compiled with numba.

They are those of lower_bound.py, upper_bound.py and nearest_first_bound.py, which explain them; a test holds this
program to those. A search asks for them at every branch, and most of their time went into handing a state from one
to the next.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

from typing import NamedTuple

import numpy as np

from replayers.counterfactual.bounds.direct_route import longest_legs
from replayers.counterfactual.bounds.nearest_first_bound import MAX_PARTS, Errands, most_of
from replayers.counterfactual.estimates.complete_linkage import merged_widths
from workbench.arrays import Bools, Floats, Ints
from workbench.third_party.kernels import kernel

NOTHING, SOMETHING_ELSE = -1, -2
"""In the hand, in place of a part of the goal."""


class PlainLog(NamedTuple):
    """One log, one task and one kind of strategy as arrays.

    Attributes:
        metres: between all locations, shape (locations, locations).
        shortest: as metres, as of LowerBound.
        at: location indices of the containers, shape (n,).
        unseen: whether a container's contents are unknown, shape (n,).
        logged: whether the log shows an instance of a part's item in it, shape (parts, n).
        may: whether an instance may be found in it, as of NearestFirstBound, shape (parts, n).
        targets: location indices, shape (parts,).
        anywhere: whether unseen containers may hold an instance, shape (parts,).
        somewhere: whether one of them must if the log shows none, shape (parts,).
        exists: the same as of NearestFirstBound, shape (parts,).
        orders: all orders of the parts, shape (orders, parts).
        look, handle: action costs.
        is_one: the goal is a part itself, no AllOf.
        nearest_first, empty_handed, plans_shortest: of SearchTraits.
    """

    metres: Floats
    shortest: Floats
    at: Ints
    unseen: Bools
    logged: Bools
    may: Bools
    targets: Ints
    anywhere: Bools
    somewhere: Bools
    exists: Bools
    orders: Ints
    look: float
    handle: float
    is_one: bool
    nearest_first: bool
    empty_handed: bool
    plans_shortest: bool


class _State(NamedTuple):
    """What is known.

    Attributes:
        here: the robot's location index.
        held: the part whose item is in the hand; NOTHING or SOMETHING_ELSE.
        sites, first: location indices of where each part's item is known to stand, and where those of each part begin
            in them, shape (parts + 1,).
        left: the containers that are not searched: in the plan's order, and in the log's; shape (2, any).
        open: the parts that are not met; all_known: nothing is missing for them.
    """

    here: int
    held: int
    sites: Ints
    first: Ints
    left: Ints
    open: Ints
    all_known: bool


@kernel()
def plain_bounds(log: PlainLog, known: Ints, left: Ints) -> tuple[float, float, bool, bool]:
    """Bounds of the cost from a state on.

    Args:
        known: the robot's location index; the part whose item is in its hand; for each part, at how many locations an
            instance is known to stand; and then these locations, part by part.
        left: the containers that are not searched: in the plan's order, and in the log's; shape (2, any).

    Returns:
        From below, from above, whether every world can meet the goal, and whether nothing is missing.
    """
    parts = len(log.targets)
    sites, first = known[2 + parts :], np.zeros(parts + 1, np.int64)
    unmet, count, all_known = np.empty(parts, np.int64), 0, True
    for p in range(parts):
        first[p + 1] = first[p] + known[2 + p]
        is_met = False
        for site in sites[first[p] : first[p + 1]]:
            is_met |= site == log.targets[p]
        if not is_met:
            unmet[count] = p
            count += 1
            all_known &= known[2 + p] > 0 or known[1] == p
    state = _State(int(known[0]), int(known[1]), sites, first, left, unmet[:count], all_known)
    low, is_certain = _least(log, state)
    high = _straight(log, state)
    if log.nearest_first and log.empty_handed and log.plans_shortest:
        high = min(high, _chains(log, state))
    return low, high, is_certain, all_known


@kernel()
def _least(log: PlainLog, state: _State) -> tuple[float, bool]:
    """The bound of LowerBound, and whether every world can meet the goal."""
    some_unseen = False
    for c in state.left[0]:
        some_unseen |= log.unseen[c]
    least, loaded, is_certain = 0.0, 0.0, True
    for p in range(len(log.targets)):
        to, is_there = log.targets[p], False
        way, carried = np.inf, np.inf
        certain = state.held == p or state.first[p + 1] > state.first[p] or (log.somewhere[p] and some_unseen)
        for site in state.sites[state.first[p] : state.first[p + 1]]:
            is_there |= site == to
            way = min(way, log.shortest[state.here, site] + log.shortest[site, to])
            carried = min(carried, log.shortest[site, to])
        is_met = is_there
        for c in state.left[0]:
            certain |= log.logged[p, c]
            if log.logged[p, c] or (log.anywhere[p] and log.unseen[c]):
                is_there |= log.at[c] == to
                way = min(way, log.shortest[state.here, log.at[c]] + log.shortest[log.at[c], to])
                carried = min(carried, log.shortest[log.at[c], to])
        is_certain &= certain
        if is_met:
            continue
        cost, share = way + log.handle + log.handle, carried + 2 * log.handle
        if state.held == p:
            cost, share = log.shortest[state.here, to] + log.handle, log.handle
        elif is_there:
            cost, share = min(cost, log.shortest[state.here, to]), 0.0
        least = max(least, cost)
        loaded += share
    return float(least if log.is_one else max(least, loaded)), bool(is_certain)


@kernel()
def _straight(log: PlainLog, state: _State) -> float:
    """The bound of UpperBound.direct_route_bound."""
    count, held = len(state.open), state.held
    held_is_wanted = held == NOTHING
    for p in state.open:
        held_is_wanted |= p == held
    if log.plans_shortest and state.all_known and held_is_wanted:
        return _known_route(log, state)
    looks = _taken(log.at, state.left[1, : 0 if state.all_known else state.left.shape[1]])
    sites, first, size = np.empty(len(state.sites) + 1, np.int64), np.zeros(count + 1, np.int64), 0
    for k in range(count):
        p = state.open[k]
        for site in state.sites[state.first[p] : state.first[p + 1]]:
            sites[size] = site
            size += 1
        if p == held:
            sites[size] = state.here
            size += 1
        first[k + 1] = size
    ends = _taken(log.targets, state.open)
    longest = longest_legs(log.metres, state.here, looks, ends, sites[:size], first, count, not log.empty_handed)
    legs = summed(longest.assigned)
    if log.nearest_first and len(looks):
        legs = min(legs, _nearest_legs(log, state.here, looks, ends) + _summed_down(longest.fetched))
    return legs + log.look * len(looks) + (_summed_down(longest.brought) + 2 * count * log.handle)


@kernel()
def _known_route(log: PlainLog, state: _State) -> float:
    """The cost of the cheapest order of deliveries; what is in hand is brought first."""
    least, parts = np.inf, len(log.targets)
    is_open = np.zeros(parts, np.bool_)
    for p in state.open:
        is_open[p] = True
    for order in log.orders:
        cost, at, begun, fits = 0.0, state.here, False, True
        for p in order:
            if not is_open[p] or not fits:
                continue
            fits, begun, end = begun or state.held in (NOTHING, p), True, log.targets[p]
            if p == state.held:
                cost += log.metres[at, end] + log.handle
            else:
                way = np.inf
                for site in state.sites[state.first[p] : state.first[p + 1]]:
                    way = min(way, log.metres[at, site] + log.metres[site, end])
                cost += way + 2 * log.handle
            at = end
        if fits:
            least = min(least, float(cost))
    return least


@kernel()
def _nearest_legs(log: PlainLog, here: int, looks: Ints, ends: Ints) -> float:
    """The bound of upper_bound.nearest_first_leg_bound, from the robot's location and from all ends."""
    n, elsewhere = len(looks), 0.0
    for k in range(len(ends) + 1):
        farthest = 0.0
        for look in looks:
            farthest = max(farthest, log.metres[here if k == 0 else ends[k - 1], look])
        elsewhere += farthest
    if n < 2:
        return elsewhere
    apart = np.empty((n, n))
    for i in range(n):
        for j in range(n):
            apart[i, j] = max(log.metres[looks[i], looks[j]], log.metres[looks[j], looks[i]])
    widths = merged_widths(apart)
    _sort(widths)
    return elsewhere + (summed(widths[1:]) + widths[-1])


@kernel()
def _chains(log: PlainLog, state: _State) -> float:
    """The bound of NearestFirstBound.remaining_cost."""
    count, left = len(state.open), state.left[0]
    if state.held != NOTHING or count > MAX_PARTS or state.all_known:
        return np.inf
    n, widest, missing, exists = len(left), 0, 0, 0
    shown, unseen, may = np.zeros(n, np.int64), np.empty(n, np.bool_), np.empty((count, n), np.bool_)
    for k in range(count):
        p = state.open[k]
        known = state.first[p + 1] - state.first[p]
        widest = max(widest, known)
        missing |= (known == 0) << k
        exists |= int(log.exists[p]) << k
        for i in range(n):
            shown[i] |= log.logged[p, left[i]] << k
            may[k, i] = log.may[p, left[i]]
            unseen[i] = log.unseen[left[i]]
    standing = np.empty((count, widest), np.int64)
    for k in range(count):
        begin, end = state.first[state.open[k]], state.first[state.open[k] + 1]
        for i in range(widest):
            standing[k, i] = state.sites[begin + i] if begin + i < end else NOTHING
    orders = np.empty((len(log.orders), count), np.int64)
    for row in range(len(log.orders)):
        size = 0
        for p in log.orders[row]:
            for k in range(count):
                if state.open[k] == p:
                    orders[row, size] = k
                    size += 1
    return most_of(
        Errands(
            metres=log.metres,
            robot=state.here,
            containers=_taken(log.at, left),
            unseen=unseen,
            shown=shown,
            may=may,
            targets=_taken(log.targets, state.open),
            standing=standing,
            missing=missing,
            exists=exists,
            orders=orders,
            look=log.look,
            handle=log.handle,
        )
    )


@kernel()
def _taken(values: Ints, places: Ints) -> Ints:
    """The values at some places: indexing with an array takes seconds to compile."""
    taken = np.empty(len(places), np.int64)
    for k in range(len(places)):
        taken[k] = values[places[k]]
    return taken


@kernel(borrows=True)
def _sort(values: Floats) -> None:
    """Sorts a few numbers, ascending: np.sort takes seconds to compile."""
    for k in range(1, len(values)):
        value, at = values[k], k
        while at > 0 and values[at - 1] > value:
            values[at] = values[at - 1]
            at -= 1
        values[at] = value


@kernel(borrows=True)
def _summed_down(values: Floats) -> float:
    """The sum from the greatest on; sorts them."""
    total = 0.0
    _sort(values)
    for k in range(len(values) - 1, -1, -1):
        total += values[k]
    return total


@kernel()
def summed(values: Floats) -> float:
    """The sum of at most 128 numbers, in the order in which numpy adds them up: bounds are the same to the last
    digit."""
    n, total = len(values), 0.0
    if n < 8:
        for value in values:
            total += value
        return total
    whole, r = n - n % 8, np.zeros(8)
    for i in range(0, whole, 8):
        for k in range(8):
            r[k] += values[i + k]
    total = ((r[0] + r[1]) + (r[2] + r[3])) + ((r[4] + r[5]) + (r[6] + r[7]))
    for i in range(whole, n):
        total += values[i]
    return total
