"""Bounds and costs in drawn worlds of a strategy, from its runs in the consistent worlds of a log.

Strategies that decide alike (strategy_traits.decision_kind) share one search. Its results do not depend on which of
them is replayed first, or alone: each would search the same tree with the same budget.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

from replayers.counterfactual.bounds.bounds import Bounds, Budget
from replayers.counterfactual.bounds.branch_and_bound import bounds_of
from replayers.counterfactual.bounds.climb import climbed_ends
from replayers.counterfactual.bounds.search_cache import SearchCache
from replayers.counterfactual.estimates.estimate import costs_in, estimate_of
from replayers.counterfactual.estimates.sampled_worlds import SampledWorlds
from replayers.counterfactual.results import Estimate, Proof
from replayers.counterfactual.run_tree import Leaf, RunTree
from workbench.arrays import Floats
from workbench.worlds.house import ContainerId


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class WorldSearch:
    """The results of one search; `bounds`, `standing` (if_beliefs_stand), `estimate`, `drawn`, `segments` and
    `asked` are as of Replay."""

    tree: RunTree
    bounds: Bounds
    standing: Bounds | None
    drawn: Floats | None
    estimate: Estimate | None
    segments: int
    asked: tuple[ContainerId, ...]


def search_worlds(tree: RunTree, worlds: SampledWorlds | None, budget: Budget, cache: SearchCache) -> WorldSearch:
    """Searches the worlds for the bounds, then follows the drawn ones.

    Args:
        worlds: the drawn ones; None without an estimate.
        cache: the searches over the log.
    """
    bounds = bounds_of(tree, budget=budget, cache=cache)
    standing = None
    if bounds.cut:
        standing = bounds_of(tree, budget=budget, whatever_is_believed=False, cache=cache)
    drawn, estimate, ends = None, None, ()
    if worlds is not None:
        drawn, done = costs_in(worlds, tree, max_segments=budget.draws)
        estimate = estimate_of(drawn, done)
        ends = tuple(tree.follow(worlds.chooser(int(world))) for world in (drawn.argmin(), drawn.argmax()))
    bounds, standing = _with_all_ends(bounds, standing, ends, tree)
    if bounds.upper_proof is Proof.NONE:
        climbed = climbed_ends(tree, standing or bounds, max_segments=budget.climb)
        bounds, standing = _with_all_ends(bounds, standing, climbed, tree)
    return WorldSearch(
        tree=tree,
        bounds=bounds,
        standing=standing,
        drawn=drawn,
        estimate=estimate,
        segments=tree.segments,
        asked=tuple(tree.asked),
    )


def _with_all_ends(
    bounds: Bounds, standing: Bounds | None, drawn: Sequence[Leaf], tree: RunTree
) -> tuple[Bounds, Bounds | None]:
    """Bounds that know of every end that was reached: in drawn worlds, and with nothing but the task's types about.

    With rounded beliefs the ends are those of whoever believes so, and say nothing of the strategy itself.
    """
    if standing is not None:
        standing = standing.with_ends(drawn)
    if tree.guesses:
        return bounds, standing
    others = (standing.cheapest, standing.most_expensive) if standing is not None else ()
    return bounds.with_ends((*others, *drawn)), standing
