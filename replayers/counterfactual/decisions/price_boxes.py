"""Whether a plan begins alike with each of many find costs: by bounds of all, or of parts of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from replayers.counterfactual.decisions.certain_plan import begins_alike
from workbench.arrays import Floats, Ints
from workbench.planning.plans import Plan
from workbench.planning.problem import Problem


def begins_alike_in_all(
    problem: Problem,
    plan: Plan,
    prices: Sequence[Floats],
    which: Ints,
    decides_so: Callable[[Ints], bool],
    *,
    at_most: int,
) -> tuple[bool, int]:
    """Whether the cheapest plan begins alike with each of many find costs, and how often that was judged.

    Where the bounds of all say nothing, they are parted in two where some cost differs most, and so on.

    Args:
        plan: an optimal plan that can be judged (certain_plan.can_be_judged).
        prices: of each type with find costs, those that it may have, shape (prices, origins, targets).
        which: combinations of them that are possible, shape (combinations, types).
        decides_so: whether the strategy decides alike with one combination, where another plan costs no more.
        at_most: how often it may be judged.
    """
    judged, waiting = 0, [which]
    while waiting:
        part = waiting.pop()
        if judged >= at_most:
            return False, judged
        judged += 1
        chosen = [price[np.unique(part[:, k])] for k, price in enumerate(prices)]
        least, most = (np.stack([getattr(price, of)(axis=0) for price in chosen]) for of in ("min", "max"))
        if begins_alike(problem, plan, least, most):
            continue
        if len(part) == 1 or not (most > least).any():  # another plan costs as much, or less
            if not decides_so(part[0]):
                return False, judged
            continue
        k, origin, target = map(int, np.unravel_index(int((most - least).argmax()), least.shape))
        cost = prices[k][part[:, k], origin, target]
        above = cost > (least[k, origin, target] + most[k, origin, target]) / 2
        waiting += [part[~above], part[above]]
    return True, judged
