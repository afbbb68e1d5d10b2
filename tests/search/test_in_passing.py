"""The search that plans for what is seen in passing: worked out by hand, and Eq. 1 where nothing comes into view."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from workbench.beliefs.belief import Belief
from workbench.search.costs import ActionCosts
from workbench.search.engine import expected_search
from workbench.search.in_passing import program
from workbench.search.in_passing.program import SightLegs, first_costs
from workbench.search.policies.registry import policy
from workbench.search.policy import SearchQuery
from workbench.search.remaining import still_missing_by_subset
from workbench.worlds.house import START, ContainerId, ItemType, LocationId
from workbench.worlds.travel import TravelCosts

MUG = ItemType("Mug")
COSTS = ActionCosts(search=1.0, manipulation=5.0)


class Views:
    """What comes into view on each way, as given."""

    def __init__(self, of: dict[tuple[str, str], tuple[tuple[str, float, float], ...]]) -> None:
        self._of = of

    def coming_into_view(self, a: LocationId, b: LocationId) -> tuple[tuple[ContainerId, float, float], ...]:
        return tuple((ContainerId(c), before, on) for c, before, on in self._of.get((a, b), ()))

    def metres_from_view(self, a: LocationId, b: LocationId) -> None:
        """As if every stop were the end of its way."""


def asked(p: list[float], metres: np.ndarray, views: Views | None, *, target: LocationId = START) -> SearchQuery:
    names = tuple(LocationId(f"c{i}") for i in range(len(p)))
    return SearchQuery(
        item_type=MUG,
        origin=START,
        target=target,
        belief=Belief(
            item_types=(MUG,), containers=tuple(map(ContainerId, names)), probability=np.array([p]), estimator="test"
        ),
        travel=TravelCosts(locations=(START, *names), metres=metres, sight=views),
        costs=COSTS,
    )


def random_metres(seed: int, n: int) -> np.ndarray:
    at = np.random.default_rng(seed).random((n + 1, 2)) * 9
    return np.linalg.norm(at[:, None] - at[None], axis=2)


def ways(metres: np.ndarray, seen: dict[tuple[int, int], list[tuple[int, float, float]]]) -> SightLegs:
    """Of travel costs whose first place is the origin, and what is seen on the way between candidates (origin: k)."""
    k = len(metres) - 1
    from_places = np.concatenate([metres[1:, 1:], metres[:1, 1:]])
    seen_, until_m = np.full((k + 1, k, k), -1), from_places.copy()
    along_m, on_m = np.zeros((k + 1, k, k)), np.zeros((k + 1, k, k))
    for (i, a), events in seen.items():
        for n, (c, before_m, after_m) in enumerate(events):
            seen_[i, a, n], along_m[i, a, n], on_m[i, a, n] = c, before_m, after_m
            if c == a:
                until_m[i, a] = before_m
    onward_m = np.minimum(
        (from_places - until_m)[:, :, None] + metres[1:, 1:][None], until_m[:, :, None] + from_places[:, None]
    )
    return SightLegs(metres=from_places, seen=seen_, along_m=along_m, on_m=on_m, until_m=until_m, onward_m=onward_m)


def test_a_table_passed_on_the_way_by_hand() -> None:
    """Origin, table and cupboard on a line at 0, 4 and 10 m; the mug is in one of the two, and comes back to 0.

    The table comes into view 2 m before it. To the cupboard, if the table is empty (0.5), 10 m, a look, the pick and
    10 m back; if it is not, 2 m, 2 m more, the pick and 4 m back. To the table first is the same but for the way on
    from its stop, which is as long.
    """
    line = np.abs(np.subtract.outer([0.0, 4.0, 10.0], [0.0, 4.0, 10.0]))
    seen = {(2, 0): [(0, 2.0, 2.0)], (2, 1): [(0, 2.0, 2.0)], (1, 0): [(0, 4.0, 2.0)]}
    missing = np.array([1.0, 0.5, 0.5, 0.0])  # after nothing, the table, the cupboard, both
    costs = first_costs(missing, ways(line, seen), 5.0 + line[1:, 0], 1.0)
    by_hand = 2 + 0.5 * (2 + 5 + 4) + 0.5 * (8 + 1 + 5 + 10)
    assert costs == pytest.approx([by_hand, by_hand])
    assert program.loops(missing, ways(line, seen), 5.0 + line[1:, 0], 1.0) == pytest.approx(costs)


@pytest.mark.parametrize("seed", range(4))
def test_where_nothing_comes_into_view_it_is_equation_1(seed: int) -> None:
    metres = random_metres(seed, 6)
    p = (np.random.default_rng(seed).random(6) * 0.5).tolist()
    blind = asked(p, metres, None)
    unseen = replace(blind, travel=replace(blind.travel, sight=Views({})))
    best = expected_search(blind, belief_model="exists", ranking="worth")
    missing = still_missing_by_subset(np.array([p]), np.arange(6)[None], "exists")[0]
    costs = first_costs(missing, ways(metres, {}), 5.0 + metres[1:, 0], 1.0)
    assert costs.min() == pytest.approx(best.cost, rel=1e-9)
    ours, theirs = policy("sight-lios"), policy("conditioned-lios")
    assert ours.first(blind) == ours.first(unseen) == theirs.first(unseen) == best.stops[0].container  # type: ignore[attr-defined]
    assert ours.order(blind) == theirs.order(blind)
    assert [s.container for s in ours.order(unseen)] == [s.container for s in theirs.order(unseen)]


def test_it_takes_the_way_that_passes_a_likely_table() -> None:
    """Two cupboards, the nearer one as likely; on the way to the other a table beside it comes into view."""
    at = np.array([[0.0, 0.0], [5.9, 0.0], [-6.0, 0.0], [-4.0, 4.0]])
    metres = np.linalg.norm(at[:, None] - at[None], axis=2)
    views = {(START, "c1"): (("c2", 2.5, 4.3),), ("c2", "c1"): (("c1", 1.0, 3.5),), ("c0", "c1"): (("c2", 8.5, 4.3),)}
    blind = asked([0.4, 0.3, 0.3], metres, None)
    seeing = replace(blind, travel=replace(blind.travel, sight=Views(views)))
    ours = policy("sight-lios")
    assert ours.first(blind) == "c0"  # type: ignore[attr-defined]
    assert ours.order(seeing)[0].container == ours.first(seeing) == "c1"  # type: ignore[attr-defined]
    assert {s.container for s in ours.order(seeing)} == {"c0", "c1", "c2"}
    assert sum(s.probability * s.reached for s in ours.order(seeing)) == pytest.approx(1.0)
