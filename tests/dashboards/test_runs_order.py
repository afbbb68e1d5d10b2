"""The table of runs: order, groups, pages and filters by hand, and what is left out is told."""

from __future__ import annotations

import re
from itertools import product
from typing import Any

import pytest

from dashboards.panels.folder.run_cells import MAX_SIDE, run_cells
from dashboards.panels.folder.runs import COLUMNS, PAGE_ROWS, RunRow, RunsOrder, left_out, ordered, passes, runs


def _row(index: int, **more: Any) -> RunRow:
    given: dict[str, Any] = {
        "file": f"run-{index:04}.mcap",
        "place": "houses:1",
        "scenario": "breakfast",
        "strategy": "lios",
        "seed": 0,
        "source": "simulation",
        "outcome": "done",
        "cost": float(index),
        "searches": 3,
    }
    return RunRow(index=index, **(given | more))


def _files(rows: list[RunRow]) -> list[int]:
    return [row.index for row in rows]


def test_rows_go_by_a_column_and_those_without_a_value_come_last() -> None:
    rows = [_row(0, cost=5.0), _row(1, cost=None), _row(2, cost=1.0), _row(3, cost=20.0)]
    assert _files(ordered(rows, RunsOrder(column="cost"))) == [2, 0, 3, 1]
    assert _files(ordered(rows, RunsOrder(column="cost", descending=True))) == [3, 0, 2, 1]
    assert _files(ordered(rows, RunsOrder(column="nothing"))) == [0, 1, 2, 3]


@pytest.mark.parametrize("column", list(COLUMNS))
def test_every_column_can_be_ordered_by(column: str) -> None:
    rows = [_row(i, place=f"p{i % 3}", seed=i % 2, searches=None if i == 2 else i, cost=None) for i in range(6)]
    assert sorted(_files(ordered(rows, RunsOrder(column=column, descending=True)))) == list(range(6))
    assert f'data-lios="order {column}"' in runs(rows, (), total=6, order=RunsOrder(column=column))


def test_groups_say_how_many_are_done_at_what_mean_cost() -> None:
    rows = [_row(0, cost=10.0), _row(1, cost=20.0, outcome="failed"), _row(2, strategy="greedy", cost=None)]
    shown = runs(rows, (), total=3, order=RunsOrder(group="strategy"))
    groups = re.findall(r'<tr class="group">.*?</tr>', shown)
    assert ["greedy" in groups[0], "lios" in groups[1], len(groups)] == [True, True, 2]
    assert "1 runs, 1 done<" in groups[0]
    assert "2 runs, 1 done, mean cost 15.0<" in groups[1]


def test_a_thousand_rows_are_paged_and_no_page_is_lost() -> None:
    rows = [_row(i) for i in range(1000)]
    seen: list[str] = []
    for page in range(5):
        shown = runs(rows, (), total=1000, order=RunsOrder(page=page, column="cost", descending=True))
        seen += re.findall(r'title="(run-\d+)\.mcap"', shown)
        assert f"{page * PAGE_ROWS + 1} to {(page + 1) * PAGE_ROWS} of 1000" in shown
    assert seen == [f"run-{i:04}" for i in reversed(range(1000))]
    assert "801 to 1000" in runs(rows, (), total=1000, order=RunsOrder(page=999)), "beyond the last is the last"


def test_a_group_across_pages_has_its_heading_on_each() -> None:
    shown = runs([_row(i) for i in range(300)], (), total=300, order=RunsOrder(group="strategy", page=1))
    assert "300 runs, 300 done" in shown


def test_filters_ask_for_the_whole_of_a_field_also_with_spaces() -> None:
    row = _row(1, strategy="pes-lios", scenario="find egg")
    assert passes(row, "lios")
    assert not passes(row, "strategy=lios")
    assert passes(row, 'strategy=pes-lios scenario="find egg"')
    assert not passes(row, 'scenario="find"')
    assert passes(row, 'scenario="find egg'), "half of a filter hides nothing that has its words"


def test_logs_that_are_left_out_are_named_and_counted() -> None:
    shown = left_out([f"{i}.mcap: <b>no</b> log" for i in range(25)])
    assert "25 logs left out" in shown
    assert "0.mcap: &lt;b&gt;no" in shown
    assert "and 5 more" in shown
    assert left_out([]) == ""


def test_an_evaluation_of_five_by_eight_has_forty_cells() -> None:
    rows = [
        _row(i, strategy=f"s{s}", scenario=f"t{t}", cost=10.0 * s + t + trial, outcome="failed" if s == 4 else "done")
        for i, (s, t, trial) in enumerate((s, t, trial) for s in range(5) for t in range(8) for trial in range(2))
    ]
    shown = run_cells(rows)
    cells = re.findall(r'data-lios="filter strategy=&#34;(\w+)&#34; scenario=&#34;(\w+)&#34;"', shown)
    assert len(set(cells)) == len(cells) == 40
    assert shown.count("<b>") == 8, "one least for each scenario"
    assert "<b>0.5</b><small> n 2" in shown
    assert shown.count("2×") == 8


def test_the_least_is_marked_only_among_means_of_the_same_tasks() -> None:
    def cells(**more: Any) -> str:
        rows = [_row(0, strategy="a"), _row(1, strategy="b"), _row(2, strategy="a", scenario="other")]
        return str(run_cells([*rows, _row(3, strategy="b", **{"scenario": "other", "seed": 0} | more)]))

    assert cells().count("<b>") == 2
    assert cells(seed=1).count("<b>") == 1
    assert cells(place="houses:2").count("<b>") == 1
    assert cells(replay_of="one.mcap").count("<b>") == 1
    assert cells(scenario="breakfast").count("<b>") == 0, "two runs against one"


def test_a_replay_says_which_log_it_is_of_and_is_found_by_it() -> None:
    replay = _row(0, source="replay", replay_of="monday.mcap")
    shown = str(runs([replay], (), total=1)).replace("<wbr>", "")
    assert "replay of monday.mcap" in shown
    assert passes(replay, "monday")
    assert "replay of" not in str(runs([_row(1)], (), total=1))


def test_more_cells_than_fit_are_told_and_one_scenario_needs_none() -> None:
    rows = [_row(i, strategy=f"s{i:03}", scenario=f"t{i % 2}") for i in range(MAX_SIDE + 3)]
    assert "3 more strategies or scenarios are left out" in run_cells(rows)
    assert run_cells([_row(i, strategy=f"s{i}") for i in range(3)]) == ""


def test_names_with_markup_and_quotes_stay_text() -> None:
    nasty = '<img src=x onerror="1">'
    rows = [_row(0, strategy=nasty, scenario=nasty), _row(1)]
    for shown in (run_cells(rows), runs(rows, (), total=2, order=RunsOrder(group="strategy"))):
        assert "<img" not in shown


def test_a_strategy_with_another_estimator_has_cells_of_its_own() -> None:
    def cells(*estimators: str) -> str:
        rows = [_row(i, scenario=s, estimator=e) for i, (e, s) in enumerate(product(estimators, ("a", "b")))]
        return str(run_cells([*rows, *(_row(9, scenario=s, strategy="greedy", estimator="best@2") for s in "ab")]))

    assert "lios by counts" in cells("counts@1", "best@2")
    assert "estimator=&#34;counts@1&#34;" in cells("counts@1", "best@2")
    assert "lios by" not in cells("best@2", "best@2")
    assert "lios by" not in cells("best@2", "best@2+memory-3")
