"""`lios houses`: results, files, refusals."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from toy import BED, toy_house, toy_travel

from workbench.cli import run
from workbench.evaluation.house_statistics import greedy_search_costs, house_figures, where_items_are


def test_greedy_costs_by_hand() -> None:
    """From the start: table 1, fridge 4, counter 5, then bed 11, desk 13. Back from there, and 5 for the pick."""
    costs = dict(zip(toy_house().item_types(), greedy_search_costs(toy_house(), toy_travel()), strict=True))
    assert costs["Plate"] == 1 + 5 + 1
    assert costs["Egg"] == 4 + 5 + 2
    assert costs["Mug"] == 5 + 5 + 2  # the nearer of two
    assert costs["Pillow"] == 11 + 5 + 6
    assert costs["CellPhone"] == 13 + 5 + 7


def test_figures_of_one_house() -> None:
    figures = house_figures([toy_house()])
    assert (figures["rooms"], figures["containers"], figures["items"], figures["area_m2"]) == (2, 5, 15, 32)
    assert figures["room_area_m2"] == {"Bedroom": 16, "Kitchen": 16}
    assert figures["reachable_share"] == 1
    rows = where_items_are({"a": [toy_house()]})
    assert rows[0] == {"item": "mug", "houses": "a", "per_house": 2, "where": [["countertop", 0.5], ["desk", 0.5]]}
    assert BED in toy_house().contents


def test_generate_info_and_stats(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "h.jsonl.gz"
    assert run(["houses", "generate", "-n", "2", "--seed", "4", "--rooms", "2-3", "-o", str(path), "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["houses"] == 2
    assert run(["houses", "generate", "-n", "2", "--seed", "4", "-o", str(path)]) == 2
    assert "--force" in capfd.readouterr().err
    assert run(["houses", "info", str(path), "--json"]) == 0
    whole = json.loads(capfd.readouterr().out)
    assert (whole["reachable_share"], whole["rooms_cut_off"]) == (1, 0)
    assert run(["houses", "info", f"{path}:1", "--json"]) == 0
    one = json.loads(capfd.readouterr().out)
    assert one["house"] == "h:1"
    assert len(one["containers_in_order"]) == one["containers"]
    assert sum(row["containers"] for row in one["reach"]) == one["containers"]
    assert all(row["free_m2"] > 0 and row["joined"] and not row["why"] for row in one["reach"])
    assert run(["houses", "info", f"{path}:1"]) == 0
    assert "item types" in capfd.readouterr().out
    assert run(["houses", "stats", str(path), "--generated", "1", "--json"]) == 0
    assert [c["houses"] for c in json.loads(capfd.readouterr().out)["columns"]] == [2, 1]
    assert run(["houses", "stats", str(path)]) == 0
    assert "greedy search cost" in capfd.readouterr().out


def test_a_seed_is_drawn_and_shown(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "h.jsonl"
    assert run(["houses", "generate", "-n", "1", "--rooms", "2", "-o", str(path)]) == 0
    assert "seed" in capfd.readouterr().err
    assert len(path.read_text().splitlines()) == 1


@pytest.mark.parametrize(
    "args",
    [
        ["generate", "-o", "h.txt"],
        ["generate", "-o", "no/such/folder/h.jsonl"],
        ["generate", "--rooms", "x", "-o", "h.jsonl"],
        ["generate", "--rooms", "3-2", "-o", "h.jsonl"],
        ["generate", "-n", "0", "-o", "h.jsonl"],
        ["generate", "--seed", "-3", "-o", "h.jsonl"],
        ["info", "nowhere.jsonl.gz:1"],
        ["stats", "nowhere.jsonl.gz"],
        ["stats", "--split", "everything"],
        ["stats", "--at-least", "99"],
        ["stats", "--measure", "no/such/folder/figures.json"],
    ],
)
def test_refusals_take_one_line_and_leave_nothing(
    args: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["houses", *args]) == 2
    assert len(capfd.readouterr().err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_stats_measure_writes_the_generators_figures(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "figures.json"
    assert run(["houses", "stats", "--measure", str(output)]) == 0
    assert json.loads(output.read_text())["houses"] == 24
    assert run(["houses", "stats", "--measure", str(output)]) == 2
