"""Where nothing needs to be put down on the way, no plan of the solver does so, whichever items are known."""

from __future__ import annotations

import numpy as np
import pytest

from replayers.counterfactual.decisions.put_down import may_put_down, put_down_plans
from workbench.worlds.travel import shortest_paths


def metric(points: np.ndarray) -> np.ndarray:
    return np.abs(points[:, None] - points[None]).sum(axis=2).astype(float)


def ways_of(metres: np.ndarray, begin: list[int], items: list[list[int]]) -> np.ndarray:
    ends = begin[1:]
    return np.array(
        [
            [min(metres[b, x] + metres[x, end] for x in some) for some, end in zip(items, ends, strict=True)]
            for b in begin
        ]
    )


def cheapest(
    metres: np.ndarray, here: int, ends: list[int], items: list[list[int]], manipulation: float, *, straight: bool
) -> float:
    """The least cost without one pick and place of each item, by trying everything (uniform-cost search)."""
    unfetched, delivered = -1, -2
    start = (here, tuple(unfetched for _ in ends))
    costs, waiting = {start: 0.0}, [(0.0, start)]
    while waiting:
        waiting.sort()
        cost, state = waiting.pop(0)
        if cost > costs[state]:
            continue
        robot, at = state
        if all(place == delivered for place in at):
            return cost
        for i, place in enumerate(at):
            if place == delivered:
                continue
            for source in items[i] if place == unfetched else [place]:
                for target in [ends[i]] if straight else range(len(metres)):
                    done = target == ends[i]
                    more = 0.0 if done else 2 * manipulation
                    spent = cost + metres[robot, source] + metres[source, target] + more
                    after = (target, (*at[:i], delivered if done else target, *at[i + 1 :]))
                    if spent < costs.get(after, np.inf) - 1e-12:
                        costs[after] = spent
                        waiting.append((spent, after))
    return float("inf")


def by_bounds(
    metres: np.ndarray,
    begin: list[int],
    items: list[list[int]],
    manipulation: float,
    others: list[list[int]] | None = None,
) -> bool:
    """By the needed items; others: all that may be known, where that is certain."""
    straight = cheapest(metres, begin[0], begin[1:], items, manipulation, straight=True)
    ways, ends = ways_of(metres, begin, items), begin[1:]
    everywhere = np.zeros((len(ends), len(metres)))
    if others is not None:
        everywhere = np.array(
            [(metres[:, some] + metres[some, end]).min(axis=1) for some, end in zip(others, ends, strict=True)]
        )
    plans = put_down_plans()
    return may_put_down(metres, ways, np.array(begin), everywhere, float(manipulation), float(straight), plans)


def test_by_hand_what_is_carried_along_and_put_down_on_the_way() -> None:
    """A mug stands where the robot is and is wanted 15 m on; after 10 m a book waits that is wanted 1 m aside. With
    cheap manipulations it is best to carry the mug along and to put it down beside the book."""
    metres = metric(np.array([(0, 0), (10, 0), (10, 1), (15, 0)]))
    begin, items = [0, 3, 2], [[0], [1]]
    assert cheapest(metres, 0, [3, 2], items, 0.1, straight=True) == 21.0
    assert cheapest(metres, 0, [3, 2], items, 0.1, straight=False) == pytest.approx(17.2)
    assert by_bounds(metres, begin, items, 0.1)
    assert not by_bounds(metres, begin, items, 5.0)


def test_what_may_be_known_excludes_more_plans() -> None:
    """The robot is at 3, a mug at 6 is wanted at 5, a book at 3 or at 0 at 1; paths form a tree. By distances from
    these places alone, a book might stand where the mug is; if there is no third one, nothing is put down."""
    metres = np.full((7, 7), 100.0)
    np.fill_diagonal(metres, 0.0)
    for a, b, length in ((0, 1, 5.0), (1, 2, 2.0), (2, 3, 5.0), (3, 4, 4.0), (3, 5, 7.0), (4, 6, 1.0)):
        metres[a, b] = metres[b, a] = length
    metres = shortest_paths(metres)
    begin, items = [3, 5, 1], [[6], [3, 0]]
    assert by_bounds(metres, begin, items, 1.0)
    assert not by_bounds(metres, begin, items, 1.0, items)


@pytest.mark.parametrize(("count", "manipulation"), [(2, 0.2), (2, 1.0), (3, 0.5), (3, 1.5)])
def test_a_plan_that_is_cheaper_is_never_missed(count: int, manipulation: float) -> None:
    """Also where items stand that are the nearest from nowhere else: they are left out of the bounds' ways."""
    rng, cheaper, excluded = np.random.default_rng(7), 0, 0
    for _ in range(40 if count == 2 else 16):
        metres = metric(rng.integers(0, 9, size=(7, 2)))
        here, *ends = rng.choice(7, size=count + 1, replace=False).tolist()
        items = [rng.choice(7, size=int(rng.integers(1, 4)), replace=False).tolist() for _ in range(count)]
        begin = [here, *ends]
        needed = [
            [
                x
                for x in some
                if any(metres[b, x] + metres[x, e] <= ways[j] for b, ways in zip(begin, by, strict=True))
            ]
            for j, (some, e, by) in enumerate(zip(items, ends, [ways_of(metres, begin, items)] * count, strict=True))
        ]
        straight = cheapest(metres, here, ends, items, manipulation, straight=True)
        assert straight == pytest.approx(cheapest(metres, here, ends, needed, manipulation, straight=True))
        found = by_bounds(metres, begin, needed, manipulation)
        is_cheaper = cheapest(metres, here, ends, items, manipulation, straight=False) < straight - 1e-9
        closer = by_bounds(metres, begin, needed, manipulation, items)
        assert closer or not is_cheaper
        assert found or not closer
        cheaper += is_cheaper
        excluded += not found
    assert excluded > 0
    assert cheaper > 0 or manipulation >= 1.0


def test_the_search_ends_early_where_most_of_the_way_is_walked_with_an_item_in_hand() -> None:
    """By what a robot that carries any number of items would walk, there would be more than 20,000 states."""
    rng = np.random.default_rng(98)
    metres = metric(rng.integers(0, 9, size=(30, 2)))
    here, *ends = rng.choice(30, size=4, replace=False).tolist()
    items = [rng.choice(30, size=2, replace=False).tolist() for _ in range(3)]
    assert not by_bounds(metres, [here, *ends], items, 1.5, items)


def test_with_many_items_nothing_is_excluded() -> None:
    metres = metric(np.random.default_rng(7).integers(0, 9, size=(9, 2)))
    begin, items = [0, 1, 2, 3, 4], [[5], [6], [7], [8]]
    assert by_bounds(metres, begin, items, 100.0)
    assert not by_bounds(metres, begin[:4], items[:3], 100.0)
