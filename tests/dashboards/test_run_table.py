"""Folders and evaluations as tables: rows from indexes and tables, points that open trials, missing logs."""

from __future__ import annotations

import json
from pathlib import Path
from shutil import copy

import pytest

from dashboards.library.library import Library
from dashboards.library.run_table import NO_LOG, NotRecorded, log_rows
from dashboards.panels.folder.runs import runs
from dashboards.panels.folder.scatter import default_pair, scatter
from recorders.simulated_run import RequestedTask, record_trial, trial_for
from workbench.errors import MalformedFile
from workbench.worlds.procthor.load import load_house
from workbench.worlds.shipped import shipped_houses

LOGS = Path(__file__).resolve().parents[2] / "logs"


def task_row(trial: int, strategy: str, cost: float) -> dict[str, object]:
    return {
        "scenario": "deliver-3",
        "strategy": strategy,
        "estimator": "counts",
        "trial": trial,
        "house": f"houses:{trial}",
        "house_index": trial,
        "seed": 100 + trial,
        "status": "done",
        "success": True,
        "cost": cost,
        "own_cost": cost,
        "searches": 3,
        "travel_m": cost,
        "decisions": 4,
        "predicted_cost": None,
        "optimal": 1.0,
        "reason": "",
        "title": "",
        "containers": 5,
        "belief_s": [],
        "planning_s": [],
    }


@pytest.fixture
def evaluation(tmp_path: Path) -> Path:
    """Two trials by two strategies; only the first trial's logs are there."""
    rows = [task_row(0, "opt-greedy", 50.0), task_row(0, "model-lios", 40.0)]
    rows += [task_row(1, "opt-greedy", 30.0), task_row(1, "model-lios", 35.0)]
    (tmp_path / "trials.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    (tmp_path / "settings.json").write_text("{}", encoding="utf-8")
    logs = tmp_path / "logs" / "deliver-3"
    logs.mkdir(parents=True)
    for strategy in ("opt-greedy", "model-lios"):
        copy(LOGS / "deliver-3.mcap", logs / f"0000-{strategy}.mcap")
    return tmp_path


def test_an_evaluation_is_its_own_table(evaluation: Path) -> None:
    library = Library([evaluation])
    rows = library.rows()
    assert [(r.strategy, r.cost, r.index) for r in rows] == [
        ("opt-greedy", 50.0, 0),
        ("model-lios", 40.0, 1),
        ("opt-greedy", 30.0, NO_LOG),
        ("model-lios", 35.0, NO_LOG),
    ]
    assert library.timeline(1).decisions, "its log can be shown"


def test_a_point_opens_its_trial_and_one_without_logs_opens_nothing(evaluation: Path) -> None:
    rows = Library([evaluation]).rows()
    made = scatter(rows, "opt-greedy", "model-lios")
    assert made.count("<circle") == 2
    assert made.count("data-lios") == 1
    assert 'data-lios="open 0,1"' in made
    assert "2.50 less" in made
    assert "cheaper in 1 and more expensive in 1" in made
    table = runs(rows, (0,), total=4)
    assert table.count('data-lios="open') == 2
    assert "open -1" not in table


def test_an_evaluation_without_logs_says_how_to_record_them(evaluation: Path) -> None:
    for path in (evaluation / "logs").rglob("*.mcap"):
        path.unlink()
    with pytest.raises(NotRecorded, match="--record"):
        Library([evaluation])


def test_a_damaged_table_is_said_with_its_line(evaluation: Path) -> None:
    with (evaluation / "trials.jsonl").open("a", encoding="utf-8") as stream:
        stream.write("{}\n{}\n")
    with pytest.raises(MalformedFile, match=r"trials.jsonl:5"):
        Library([evaluation])


def test_an_evaluation_of_searches_opens_too(tmp_path: Path) -> None:
    (tmp_path / "search.json").write_text("{}", encoding="utf-8")
    (tmp_path / "trials.csv").write_text(
        "house,item_type,kind,policy,cost,searches,predicted,corrected,order\n"
        "houses:9,Mug,ai2-thor,greedy,20.5,4,,,a b\nhouses:9,Mug,ai2-thor,lios,10.5,2,,,a\n",
        encoding="utf-8",
    )
    logs = tmp_path / "logs" / "houses-9"
    logs.mkdir(parents=True)
    copy(LOGS / "find-lios.mcap", logs / "Mug.lios.mcap")
    rows = Library([tmp_path]).rows()
    assert [(r.scenario, r.strategy, r.index) for r in rows] == [
        ("find mug", "greedy", NO_LOG),
        ("find mug", "lios", 0),
    ]
    (tmp_path / "trials.csv").write_text("house,policy\nx,y\n", encoding="utf-8")
    with pytest.raises(MalformedFile, match="no table of searches"):
        Library([tmp_path])


def test_a_folder_is_listed_without_reading_a_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIOS_CACHE", str(tmp_path / "cache"))
    house = load_house(f"{shipped_houses()}:1")
    for strategy in ("model-lios", "opt-greedy"):
        trial = trial_for(RequestedTask(find="book"), house, strategy=strategy, estimator="counts")
        record_trial(trial, tmp_path / "logs" / f"{strategy}.mcap")
    (tmp_path / "logs" / "broken.mcap").write_bytes(b"not a log")
    monkeypatch.setattr("replayers.runs.run.read", lambda *a, **k: pytest.fail("a run was read for the table"))
    library = Library([tmp_path / "logs"])
    rows = library.rows()
    assert [(r.scenario, r.strategy, r.outcome) for r in rows] == [
        ("find book", "model-lios", "done"),
        ("find book", "opt-greedy", "done"),
    ]
    assert all(r.cost is not None and r.searches is not None for r in rows)
    assert len(library.unreadable) == 1
    assert "broken.mcap" in library.unreadable[0]


def test_a_baseline_goes_across_and_ours_up() -> None:
    assert default_pair(["conditioned-lios", "model-lios", "opt-greedy"]) == ("opt-greedy", "conditioned-lios")
    assert default_pair(["a", "b"]) == ("a", "b")
    assert default_pair(["a"]) == ("a", "a")


def test_what_an_undecided_replay_had_spent_is_not_its_cost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its log stops where nobody looked on: it takes no part in filters by cost, nor in the scatter."""
    from replayers.log_tools import listing

    done = listing.LogRow(file="a.mcap", strategy="lios", status="done", cost=10.0)
    open_ended = listing.LogRow(file="b.mcap", strategy="greedy", status="undetermined", source="replay")
    monkeypatch.setattr(listing, "rows_of", lambda *_, **__: [done, open_ended])
    rows, _ = log_rows([tmp_path / "a.mcap", tmp_path / "b.mcap"], folder=None)
    assert [row.cost for row in rows] == [10.0, None]
    assert "No task was run by both" in scatter(rows, "lios", "greedy")
    assert '<td class="n">–</td>' in runs(rows, (0,), total=2)
