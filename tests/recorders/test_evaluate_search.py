"""`lios evaluate search`: its answer, its files, its logs, its bad input."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
from matplotlib.image import imread

from replayers.runs.run import read
from workbench.cli import run
from workbench.evaluation.search import experiment
from workbench.evaluation.search.experiment import HouseResult
from workbench.worlds.shipped import shipped_houses

COUNTS = ["--estimator", "counts", "--paper-estimator", "counts"]


@pytest.fixture(scope="module")
def two_houses(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The two smallest of the shipped houses."""
    import gzip

    with gzip.open(shipped_houses(), "rt", encoding="utf-8") as file:
        lines = sorted(file, key=len)[:2]
    path = tmp_path_factory.mktemp("houses") / "two.jsonl"
    path.write_text("".join(lines), encoding="utf-8")
    return path


def answer(capsys: pytest.CaptureFixture[str], *args: str) -> dict[str, object]:
    assert run(["evaluate", "search", *args, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.ci
def test_every_pair_of_house_and_item_is_asked_under_every_policy(
    two_houses: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = answer(capsys, "--houses", str(two_houses), *COUNTS, "-o", str(tmp_path / "out"))
    rows = {row["policy"]: row for row in found["rows"]}  # type: ignore[attr-defined]
    assert next(iter(rows)) == "greedy"
    assert list(rows)[-1] == "oracle"
    assert {"lios", "most-probable", "conditioned-lios", "full-lios"} <= set(rows)
    assert len({row["queries"] for row in rows.values()}) == 1
    assert rows["oracle"]["oracle_gap_closed"] == 1
    assert rows["greedy"]["oracle_gap_closed"] == 0
    assert all(row["mean_cost"] >= rows["oracle"]["mean_cost"] for row in rows.values())
    with (tmp_path / "out" / "trials.csv").open() as file:
        trials = list(csv.DictReader(file))
    assert len(trials) == len(rows) * rows["lios"]["queries"]
    lios = [float(t["cost"]) for t in trials if t["policy"] == "lios"]
    assert sum(lios) / len(lios) == pytest.approx(rows["lios"]["mean_cost"], abs=1e-5)
    assert json.loads((tmp_path / "out" / "search.json").read_text())["rows"] == found["rows"]
    assert "conditioned-lios" in (tmp_path / "out" / "search.md").read_text()
    figures = sorted(p.name for p in (tmp_path / "out" / "figures").iterdir())
    assert figures == [
        "example_trial.png",
        "gap_closed.png",
        "predicted_against_realised.png",
        "scatter_against_greedy.png",
        "worked_example.png",
    ]
    assert all(imread(tmp_path / "out" / "figures" / name).std() > 0.01 for name in figures)


def test_drawn_queries_are_recorded_and_cost_what_was_measured(
    two_houses: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    asked = ["--houses", str(two_houses), *COUNTS, "--queries", "2", "--seed", "3", "--policies", "lios,full-lios"]
    found = answer(capsys, *asked, "--record", "--no-figures", "-o", str(out))
    assert found["logs"] == 8
    with (out / "trials.csv").open() as file:
        trials = list(csv.DictReader(file))
    logs = sorted((out / "logs").rglob("*.mcap"))
    assert len(logs) == len(trials) == 8
    for trial in trials:
        log = read(next(p for p in logs if (p.parent.name, p.name) == _where(trial)))
        assert log.outcome is not None
        assert log.outcome.cost == pytest.approx(float(trial["cost"]), abs=1e-5)
        looked = [o.container for o in log.observations if not o.known_at_start]
        assert looked == trial["order"].split(" ")


def _where(trial: dict[str, str]) -> tuple[str, str]:
    """A trial's folder and file."""
    return trial["house"].replace(":", "-"), f"{trial['item_type']}.{trial['policy']}.mcap"


def test_the_same_seed_draws_the_same_queries(two_houses: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["--houses", str(two_houses), *COUNTS, "--queries", "3", "--policies", "lios"]
    costs = [[row["mean_cost"] for row in answer(capsys, *asked)["rows"]] for _ in range(2)]  # type: ignore[attr-defined]
    assert costs[0] == costs[1]


def test_a_dry_run_says_what_would_be_run(two_houses: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = answer(capsys, "--houses", str(two_houses), "--dry-run", "--policies", "lios")
    assert found == {"houses": 2, "queries": "all", "policies": ["greedy", "lios", "oracle"], "seed": 0}


def test_people_get_a_table_and_the_gain_over_the_paper(two_houses: Path, capsys: pytest.CaptureFixture[str]) -> None:
    args = ["--houses", str(two_houses), *COUNTS, "--queries", "5", "--policies", "lios,conditioned-lios"]
    assert run(["evaluate", "search", *args]) == 0
    shown = capsys.readouterr()
    assert "oracle gap closed" in shown.out
    assert re.search(r"[+-]\d+\.\d %", shown.out), "shares read as signed percentages"
    assert "against lios" in shown.err


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (["--policies", "lioss"], "lios"),
        (["--queries", "many"], "--queries"),
        (["--queries", "0"], "--queries"),
        (["--split", "half"], "part of the houses"),
        (["--estimator", "oracle-of-delphi"], "counts"),
        (["--search-cost", "-1"], "search"),
        (["--search-cost", "nan"], "search"),
        (["--workers", "0"], "workers"),
        (["--houses", "nowhere.jsonl"], "nowhere.jsonl"),
        (["--seed", "-1"], "--seed"),
        (["--record"], "--output"),
    ],
)
def test_bad_usage_is_one_line_and_exit_code_2(
    args: list[str], said: str, two_houses: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    houses = [] if "--houses" in args else ["--houses", str(two_houses)]
    assert run(["evaluate", "search", *houses, *args]) == 2
    shown = capsys.readouterr().err.strip()
    assert said in shown
    assert "Traceback" not in shown


def test_a_report_is_not_replaced_unless_asked(two_houses: Path, tmp_path: Path) -> None:
    args = ["evaluate", "search", "--houses", str(two_houses), *COUNTS, "--queries", "1", "--no-figures"]
    out = ["-o", str(tmp_path / "out")]
    assert run([*args, *out]) == 0
    assert run([*args, *out]) == 2
    assert run([*args, *out, "--force"]) == 0
    (tmp_path / "file").write_text("")
    assert run([*args, "-o", str(tmp_path / "file")]) == 2


def test_a_house_that_holds_nothing_gives_no_query(tmp_path: Path, two_houses: Path) -> None:
    house = json.loads(two_houses.read_text().splitlines()[0])
    for thing in house["objects"]:
        thing["children"] = []
    path = tmp_path / "bare.jsonl"
    path.write_text(json.dumps(house) + "\n")
    assert run(["evaluate", "search", "--houses", str(path), *COUNTS]) == 1


def test_a_stopped_evaluation_goes_on_where_it_was(
    two_houses: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ["--houses", str(two_houses), *COUNTS, "-p", "lios", "--no-figures"]
    whole = answer(capsys, *words)
    first: list[HouseResult] = []

    def stopped(jobs: Iterable[Any]) -> Iterator[HouseResult]:
        for job in jobs:
            if first:
                raise KeyboardInterrupt
            first.append(experiment._house_of(job))
            yield first[0]

    with monkeypatch.context() as patch:
        patch.setattr(experiment, "run_in_order", lambda _, jobs, **__: stopped(jobs))
        assert run(["evaluate", "search", *words, "-o", str(tmp_path / "out")]) != 0
    kept = tmp_path / "out" / "houses.jsonl"
    assert len(kept.read_bytes().splitlines()) == 1
    again: list[str] = []
    run_house = experiment._house_of
    with monkeypatch.context() as patch:
        patch.setattr(experiment, "_house_of", lambda job: again.append(job[1].name) or run_house(job))
        found = answer(capsys, *words, "-o", str(tmp_path / "out"))
    assert len(again) == 1
    assert again != [first[0].house]
    assert not kept.exists()
    for row in (*found["rows"], *whole["rows"]):  # type: ignore[attr-defined]
        row.pop("ms_a_decision")
    assert found["rows"] == whole["rows"]
