"""The choice of a first step by rollouts, compiled with numba: the alternatives, the worlds that are sampled from the
belief, and the comparison of mean costs.

Import this module lazily: importing numba takes most of a second.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

from math import sqrt

import numpy as np

from workbench.arrays import Bools, Floats, Ints, Uints8
from workbench.planning.rollouts.delivery_state import DeliveryState
from workbench.planning.rollouts.kernels import NONE, fill_costs, scratch, slack
from workbench.third_party.kernels import kernel
from workbench.tolerances import RELATIVE

SCREENING_FRACTION, REJECT_STANDARD_ERRORS = 6, 2.0
"""All steps are tried in a sixth of the worlds; those worse than the best by two standard errors are then dropped."""

NEGLIGIBLE_DETOUR_M = 0.5
"""Detours shorter than this many metres count as zero when looks are ranked."""


@kernel()
def best_first_step(own: int, looks: int, here: DeliveryState, even: Floats, uniform: Floats) -> tuple[int, int]:
    """The first step of least mean cost over sampled worlds; of equal ones the earlier.

    All steps are tried in the first worlds; only those not clearly worse than the best are tried in the rest.

    Args:
        own: the decision's own first step, which comes first; steps are moves (delivery_state.Scratch).
        looks: most looks among the others.
        even, uniform: random numbers for each want that is neither met nor in hand (sample_worlds), shapes (wants,
            worlds) and (wants, worlds, n).

    Returns:
        The step, and the location to which it leads first.
    """
    steps = candidate_steps(own, looks, here)
    best, worlds, kept = 0, uniform.shape[1], np.ones(len(steps), np.bool_)
    if len(steps) > 1:
        shows, left = np.zeros((worlds, len(here.containers)), np.uint8), _left(here)
        for i in range(len(left)):
            want = left[i]
            sample_worlds(here.chance[want], bool(here.find[want] >= 0), even[i], uniform[i], want, shows)
        few = max(worlds // SCREENING_FRACTION, 1)
        costs, room = np.empty((len(steps), worlds)), scratch(here, worlds)
        fill_costs(costs[:, :few], steps, kept, here, shows[:few], room)
        best = _least_mean(costs[:, :few], kept)
        _drop_clearly_worse(costs[:, :few], kept, best)
        if few < worlds:
            fill_costs(costs[:, few:], steps, kept, here, shows[few:], room)
            best = _least_mean(costs[:, :worlds], kept)
    return steps[best], leads_to(steps[best], here)


@kernel()
def candidate_steps(own: int, looks: int, here: DeliveryState) -> Ints:
    """The decision's own first step, then the alternatives: fetching each known item, and at most `looks` looks.

    Looks are ranked by chance against the way, for one want and for all of them, and by chance against the detour
    from the way to the decision's first place. There are no alternatives if nothing is left to find.
    """
    left, n = _left(here), len(here.containers)
    steps, count = np.empty(1 + len(left) + n, np.int64), 1
    steps[0] = own
    for i in range(len(left)):
        if here.hand < 0 and here.known[left[i]] > 0 and n + left[i] != own:
            steps[count] = n + left[i]
            count += 1
    worths = _worths_of_looks(left, leads_to(own, here), here)
    is_left, taken, listed = np.ones(worths.shape, np.bool_), np.zeros(n, np.bool_), 0
    hopeless = True
    for _ in range(n):
        for ranking in range(len(worths)):
            a = _greatest_left(worths[ranking], is_left[ranking])
            is_left[ranking, a] = False
            if worths[1, a] > 0:
                hopeless = False
                if not taken[a] and listed < looks:
                    taken[a] = True
                    listed += 1
                    if a != own:
                        steps[count] = a
                        count += 1
        if listed == looks:
            break
    return steps[:1] if hopeless else steps[:count]


@kernel()
def _left(here: DeliveryState) -> Ints:
    """The wants that are neither met nor in hand."""
    left, count = np.empty(len(here.targets), np.int64), 0
    for want in range(len(here.targets)):
        if not here.done >> want & 1 and want != here.hand:
            left[count] = want
            count += 1
    return left[:count]


@kernel()
def leads_to(step: int, here: DeliveryState) -> int:
    """The location to which a step leads first: of known instances the one with the shortest way through it."""
    n, least = len(here.containers), np.inf
    if step < n:
        return here.containers[step]
    want = step - n
    for i in range(here.known[want]):
        least = min(least, _way_through(here.places[want, i], want, here))
    for i in range(here.known[want]):
        if here.hand != want and _way_through(here.places[want, i], want, here) <= least + slack(least):
            return here.places[want, i]
    return here.targets[want]


@kernel(inline="always")
def _way_through(place: int, want: int, here: DeliveryState) -> float:
    """Metres from the robot through a place to the want's target."""
    return here.metres[here.robot, place] + here.metres[place, here.targets[want]]


@kernel()
def _worths_of_looks(left: Ints, onward: int, here: DeliveryState) -> Floats:
    """The three rankings of looks, shape (3, n); the second is above 0 where anything may be found."""
    worths = np.zeros((3, len(here.containers)))
    for a in range(len(here.containers)):
        place, everything = here.containers[a], 0.0
        from_m = here.metres[here.robot, place]
        for want in left:
            chance, to_m = here.chance[want, a], here.metres[place, here.targets[want]]
            worths[0, a] = max(worths[0, a], chance / (1.0 + from_m + to_m / 2.0))
            everything += chance
        detour = from_m + here.metres[place, onward] - here.metres[here.robot, onward]
        worths[1, a] = everything / (1.0 + from_m)
        worths[2, a] = everything / (NEGLIGIBLE_DETOUR_M + detour)
    return worths


@kernel()
def _greatest_left(worth: Floats, is_left: Bools) -> int:
    """The first of those left that are equal to the greatest: ties.ranked, one place at a time."""
    greatest = -np.inf
    for a in range(len(worth)):
        if is_left[a]:
            greatest = max(greatest, worth[a])
    for a in range(len(worth)):
        if is_left[a] and worth[a] >= greatest - RELATIVE * abs(greatest):
            return a
    return NONE


@kernel()
def _least_mean(costs: Floats, kept: Bools) -> int:
    """The step of least mean cost, of those kept; of equal ones (ties.py) the first. Costs: shape (steps, worlds)."""
    least = np.inf
    for step in range(len(kept)):
        if kept[step]:
            least = min(least, _mean(costs[step]))
    for step in range(len(kept)):
        if kept[step] and _mean(costs[step]) <= least + slack(least):
            return step
    return NONE


@kernel()
def _mean(costs: Floats) -> float:
    total = 0.0
    for world in range(len(costs)):
        total += costs[world]
    return total / len(costs)


@kernel()
def _drop_clearly_worse(costs: Floats, kept: Bools, best: int) -> None:
    """Drop the steps that are worse than the best by more than two standard errors; costs: shape (steps, worlds)."""
    worlds = costs.shape[1]
    equal = slack(_mean(costs[best]))
    for step in range(len(kept)):
        mean, variance = 0.0, 0.0
        for world in range(worlds):
            mean += (costs[step, world] - costs[best, world]) / worlds
        for world in range(worlds):
            variance += (costs[step, world] - costs[best, world] - mean) ** 2 / worlds
        kept[step] = mean <= REJECT_STANDARD_ERRORS * sqrt(variance / worlds) + equal


@kernel()
def sample_worlds(chance: Floats, exists: bool, even: Floats, uniform: Floats, want: int, shows: Uints8) -> None:
    """Sample where one wanted item type is in each world.

    Args:
        chance: probability of each container, below 1, shape (n,).
        exists: at least one container holds it; `even` then selects the first one, so that stratified numbers
            give stratified worlds.
        even, uniform: random numbers in [0, 1), shapes (worlds,) and (worlds, n).
        shows: output, whose bit `want` is set where the container holds the type, shape (worlds, n).
    """
    worlds, n = shows.shape
    none = 1.0
    for a in range(n):
        none *= 1.0 - chance[a]
    for w in range(worlds):
        first = -1
        if exists:
            upto, miss = 0.0, 1.0
            wanted = even[w] * (1.0 - none)
            for first in range(n):
                upto += miss * chance[first]
                miss *= 1.0 - chance[first]
                if wanted < upto:
                    break
            shows[w, first] |= 1 << want
        for a in range(first + 1, n):
            if uniform[w, a] < chance[a]:
                shows[w, a] |= 1 << want
