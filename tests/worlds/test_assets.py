"""Exact sizes beside the houses are used unless others are given."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from procthor_house import two_rooms

from workbench.cli import run
from workbench.worlds.procthor.assets import COLUMNS, assets_for


def write_table(path: Path) -> Path:
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([COLUMNS, ("Fridge_1", "Fridge", "0.8", "1.9", "0.7")])
    return path


def test_the_table_beside_the_houses_is_taken_and_another_one_overrides(tmp_path: Path) -> None:
    houses, given = tmp_path / "houses.jsonl", tmp_path / "mine.csv"
    assert assets_for(houses, None) is None
    assert assets_for(houses, given) == given
    beside = write_table(tmp_path / "asset_sizes.csv")
    assert assets_for(houses, None) == beside
    assert assets_for(f"{houses}:17", None) == beside
    assert assets_for(houses, given) == given


@pytest.mark.parametrize("command", ["belief", "search"])
def test_an_evaluation_says_which_table_it_used(
    command: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    houses = tmp_path / "houses.jsonl"
    houses.write_text(json.dumps(two_rooms()) + "\n")
    more = ["--estimators", "counts"] if command == "belief" else ["--policies", "greedy"]
    assert run(["evaluate", command, "--houses", str(houses), *more, "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["assets"] is None
    beside = write_table(tmp_path / "asset_sizes.csv")
    assert run(["evaluate", command, "--houses", str(houses), *more, "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["assets"] == str(beside)


def test_a_recorded_house_has_the_sizes_of_the_table_beside_it(tmp_path: Path) -> None:
    from replayers.runs.run import read
    from workbench.worlds.procthor.load import load_house

    record = two_rooms()
    fridge = next(thing for thing in record["objects"] if thing["objectType"] == "Fridge")
    fridge["assetId"] = "Fridge_1"
    houses = tmp_path / "houses.jsonl"
    houses.write_text(json.dumps(record) + "\n")
    write_table(tmp_path / "asset_sizes.csv")
    log = tmp_path / "run.mcap"
    assert run(["record", "--house", f"{houses}:0", "--find", "Egg", "--estimator", "counts", "-o", str(log)]) == 0
    exact = load_house(f"{houses}:0", assets=tmp_path / "asset_sizes.csv")
    usual = load_house(f"{houses}:0")
    (mine,) = (tuple(c.size_m) for c in read(log).place.plan.containers if c.type == "Fridge")
    assert mine == next(c.size_m for c in exact.plan.containers if c.type == "Fridge")
    assert mine != next(c.size_m for c in usual.plan.containers if c.type == "Fridge")
