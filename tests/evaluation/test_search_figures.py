"""Figures of the object search show what was computed."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from workbench.evaluation.figures.gap_closed import draw_gap_closed
from workbench.evaluation.figures.predicted_cost import draw_predicted_cost
from workbench.evaluation.figures.search_figures import best_policy, example_query
from workbench.evaluation.figures.style import new_figure, save
from workbench.evaluation.figures.worked_example import steps_in_words, worked_query
from workbench.evaluation.search.table import costs_of, rows
from workbench.evaluation.search.trials import SearchTrial
from workbench.search.engine import expected_search
from workbench.worlds.house import ContainerId, ItemType

C = ContainerId("c")


def trials(costs: dict[str, tuple[float, ...]], looks: int = 2) -> tuple[SearchTrial, ...]:
    return tuple(
        SearchTrial(house="a", item_type=ItemType(f"T{i}"), policy=name, cost=cost, order=(C,) * looks)
        for name, values in costs.items()
        for i, cost in enumerate(values)
    )


def test_the_worked_example_is_worked_out_right() -> None:
    """Table first: 1.8 + 0.15 x (5 + 1.8) = 2.82; fridge 0.85 x [2.7 + 0.60 x (5 + 4.5)] = 7.14; shelf 2.35."""
    query = worked_query()
    search = expected_search(query)
    words = steps_in_words(query, search)
    assert [line.split(":")[0].strip() for line in words] == ["table", "fridge", "shelf", "sum"]
    assert [line.rsplit("=", 1)[1].strip() for line in words[:-1]] == ["2.82", "7.14", "2.35"]
    assert "12.31; not found with chance 0.26" in words[-1]


def test_the_example_is_the_query_whose_saving_is_nearest_to_the_mean() -> None:
    """Savings 0.9, 0.5 and 0.1 of equal costs, 0.5 in all: the second."""
    drawn = trials({"greedy": (100, 100, 100), "lios": (10, 50, 90), "oracle": (5, 5, 5)})
    costs = costs_of(drawn)
    assert best_policy(costs) == "lios"
    pair = example_query(costs, drawn)
    assert pair is not None
    assert (pair[0].policy, pair[1].policy, pair[1].item_type) == ("greedy", "lios", "T1")


def test_there_is_no_example_where_greedy_is_best() -> None:
    drawn = trials({"greedy": (10, 10), "lios": (20, 20), "oracle": (5, 5)})
    assert example_query(costs_of(drawn), drawn) is None


def test_bars_stand_for_the_share_of_the_gap() -> None:
    drawn = trials({"greedy": (30, 20), "lios": (20, 15), "oracle": (10, 10)})
    _, (ax,) = new_figure(4, 3)
    draw_gap_closed(ax, rows(costs_of(drawn), seed=1), title="all")
    assert [bar.get_width() for bar in ax.patches] == [pytest.approx(0.5)]


def test_the_interval_of_few_houses_does_not_push_the_figure_apart(tmp_path: Path) -> None:
    row = {"policy": "lios", "oracle_gap_closed": 0.9, "oracle_gap_closed_ci95": (-9.0, 40.0)}
    figure, (ax,) = new_figure(4, 2.4)
    draw_gap_closed(ax, [row], title="all")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        save(figure, tmp_path / "gap.png")
    (text,) = ax.texts
    assert text.get_position()[0] < ax.get_xlim()[1]


def test_the_line_runs_through_the_means_of_tenths() -> None:
    predicted = np.arange(1.0, 101.0)
    _, (ax,) = new_figure(4, 4)
    draw_predicted_cost(ax, predicted, 2 * predicted, name="x", colour="black")
    means = ax.lines[-1].get_xydata()
    assert len(means) == 10
    assert np.asarray(means)[0] == pytest.approx((5.5, 11.0))
    assert "2.000" in ax.get_title()


def test_the_same_drawing_has_the_same_bytes(tmp_path: Path) -> None:
    def drawn(name: str) -> bytes:
        figure, (ax,) = new_figure(3, 3)
        draw_predicted_cost(ax, np.arange(1.0, 9.0), np.arange(1.0, 9.0), name="x", colour="black")
        return save(figure, tmp_path / name).read_bytes()

    assert drawn("a.png") == drawn("b.png")
