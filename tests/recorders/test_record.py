"""`lios record`: the same seed gives the same bytes; bad input gives one clear line, exit code 2 and no file."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from pathlib import Path

import pytest
from toy import toy_house

from recorders.simulated_run import (
    NotExactlyOneTask,
    RequestedTask,
    item_type_in,
    record_trial,
    trial_events,
    trial_for,
)
from replayers.mcap_io.reader import messages
from replayers.runs.run import read
from workbench import cli
from workbench.log_schema.events import REPEATABLE
from workbench.worlds.procthor.load import load_house
from workbench.worlds.shipped import shipped_houses

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def lios(capsys: pytest.CaptureFixture[str]) -> Run:
    def run(*words: str | Path) -> tuple[int, str, str]:
        code = cli.run([str(w) for w in words])
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


def _repeatable(path: Path) -> list[tuple[str, bytes]]:
    return [(m.topic, m.data) for m in messages(path) if m.topic in REPEATABLE]


def test_a_shipped_house_is_recorded_and_read_back(lios: Run, tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    code, out, _ = lios("record", "--find", "mug", "--strategy", "lios", "-o", log, "--json")
    answer = json.loads(out)
    run = read(log)
    assert code == 0
    assert answer["status"] == "done"
    assert answer["strategy"] == run.info.strategy == "model-lios", "an alias is resolved"
    assert run.outcome is not None
    assert run.outcome.cost == pytest.approx(answer["cost"], abs=1e-5)
    assert run.outcome.searches == answer["searches"] == sum(not o.known_at_start for o in run.observations)
    assert run.plans[0].reason == "start"
    assert run.truth is None, "the truth is hidden unless asked for"


def test_a_run_goes_on_in_further_files_that_merge_to_itself(lios: Run, tmp_path: Path) -> None:
    wanted = ("record", "--find", "mug", "--strategy", "lios", "-o")
    assert lios(*wanted, tmp_path / "whole.mcap")[0] == 0
    code, out, err = lios(*wanted, tmp_path / "run.mcap", "--split-s", "12", "--json")
    parts = [Path(name) for name in json.loads(out)["parts"]]
    assert code == 0
    assert [part.name for part in parts] == [f"run_{i:04d}.mcap" for i in range(len(parts))]
    assert len(parts) > 1
    for part in parts:
        assert read(part).place.plan.containers
        assert lios("doctor", part)[0] == 0
    assert lios("log", "merge", *parts, "-o", tmp_path / "run.mcap")[0] == 0
    assert sorted(_repeatable(tmp_path / "run.mcap")) == sorted(_repeatable(tmp_path / "whole.mcap"))
    code, _, err = lios(*wanted, tmp_path / "run.mcap", "--split-mb", "5")
    assert code == 2
    assert "run_0000.mcap exists" in err
    code, _, err = lios(*wanted, tmp_path / "other.mcap", "--split-mb", "0")
    assert code == 2
    assert "more than 0 bytes" in err
    assert not list(tmp_path.glob("other*"))


@pytest.mark.parametrize("strategy", ["lios", "greedy", "conditioned-lios", "oracle"])
def test_the_same_seed_gives_the_same_bytes(strategy: str, tmp_path: Path) -> None:
    house = load_house(f"{shipped_houses()}:1")
    wanted = house.item_types()[0]
    logs = [tmp_path / "a.mcap", tmp_path / "b.mcap"]
    for log in logs:
        record_trial(trial_for(RequestedTask(find=wanted), house, strategy=strategy, seed=3, max_known=0.2), log)
    once, twice = (_repeatable(log) for log in logs)
    assert once == twice
    assert len(once) > 5


def test_what_is_recorded_is_what_happened(tmp_path: Path) -> None:
    trial = trial_for(RequestedTask(find="mug"), toy_house(), strategy="lios", estimator="counts")
    end = record_trial(trial, tmp_path / "run.mcap")
    assert end == list(trial_events(trial))[-1]


@pytest.mark.parametrize("name", ["mug", "MUG", "Mug", "cell phone", "cell-phone", "CellPhone"])
def test_item_types_are_found_as_people_write_them(name: str) -> None:
    assert item_type_in(toy_house(), name) in {"Mug", "CellPhone"}


def test_a_wish_is_one_wish() -> None:
    with pytest.raises(NotExactlyOneTask, match="no task"):
        RequestedTask()
    with pytest.raises(NotExactlyOneTask, match="more than one"):
        RequestedTask(find="mug", scenario="coffee")


def _room() -> dict[str, object]:
    corners = [(0, 0), (4, 0), (4, 4), (0, 4)]
    return {
        "id": "room|1",
        "roomType": "Kitchen",
        "floorPolygon": [{"x": x, "y": 0, "z": z} for x, z in corners],
    }


def _house(**changes: object) -> dict[str, object]:
    table = {
        "id": "DiningTable|1|0",
        "objectType": "DiningTable",
        "assetId": "Dining_Table_1",
        "position": {"x": 3.0, "y": 0.4, "z": 3.0},
        "rotation": {"x": 0, "y": 0, "z": 0},
        "children": [
            {
                "id": "Mug|1|0",
                "objectType": "Mug",
                "assetId": "Mug_1",
                "position": {"x": 3.0, "y": 0.8, "z": 3.0},
                "rotation": {"x": 0, "y": 0, "z": 0},
            }
        ],
    }
    house: dict[str, object] = {
        "rooms": [_room()],
        "walls": [],
        "doors": [],
        "windows": [],
        "objects": [table],
        "metadata": {"agent": {"position": {"x": 1.0, "y": 0.9, "z": 1.0}, "rotation": {"x": 0, "y": 0, "z": 0}}},
    }
    return {**house, **changes}


def _apart() -> dict[str, object]:
    far = {
        **_room(),
        "id": "room|2",
        "floorPolygon": [{"x": x, "y": 0, "z": z} for x, z in [(20, 0), (24, 0), (24, 4), (20, 4)]],
    }
    return _house(rooms=[_room(), far])


def test_a_house_by_hand_is_recorded(lios: Run, tmp_path: Path) -> None:
    place = tmp_path / "a house «with» 'quotes' [и] 家.json"
    place.write_text(json.dumps(_house()), encoding="utf-8")
    log = tmp_path / "ein Lauf [1].mcap"
    code, out, err = lios("record", "--house", place, "--find", "mug", "-o", log, "--json")
    assert code == 0, err
    assert json.loads(out)["place"] == read(log).info.place


BAD = {
    "no such file": (lambda p: None, "no such file"),
    "truncated gzip": (lambda p: p.write_bytes(gzip.compress(json.dumps(_house()).encode())[:-20]), ""),
    "no JSON": (lambda p: p.write_bytes(gzip.compress(b"this is no JSON\n")), ""),
    "no house": (lambda p: p.write_bytes(gzip.compress(b'{"a": 1}\n')), ""),
    "a list": (lambda p: p.write_bytes(gzip.compress(b"[1, 2]\n")), ""),
    "no rooms": (lambda p: p.write_bytes(gzip.compress(json.dumps(_house(rooms=[])).encode())), "room"),
    "rooms apart": (lambda p: p.write_bytes(gzip.compress(json.dumps(_apart()).encode())), "room"),
    "NaN": (lambda p: p.write_bytes(gzip.compress(json.dumps(_house()).replace("3.0", "NaN").encode())), ""),
    "huge": (lambda p: p.write_bytes(gzip.compress(json.dumps(_house()).replace("3.0", "3e30").encode())), ""),
    "empty": (lambda p: p.write_bytes(gzip.compress(b"")), ""),
}


@pytest.mark.parametrize("case", sorted(BAD))
def test_a_bad_house_is_one_line_and_no_file(case: str, lios: Run, tmp_path: Path) -> None:
    write, says = BAD[case]
    place, log = tmp_path / "houses.jsonl.gz", tmp_path / "run.mcap"
    write(place)
    code, out, err = lios("record", "--house", f"{place}:0", "--find", "mug", "-o", log)
    assert code == 2, err
    assert out == ""
    assert err.count("\n") == 1
    assert "should not happen" not in err
    assert says in err
    assert not log.exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--find", "mugg"), "Did you mean: Mug"),
        (("--find", "mug", "--strategy", "gredy"), "greedy"),
        (("--find", "mug", "--estimator", "bset"), "best"),
        (("--find", "mug", "--house", f"{shipped_houses()}:99"), "99"),
        (("--find", "mug", "--known", "7"), "within"),
        (("--scenario", "brekfast"), "breakfast"),
        (("--task", "no-such.yaml"), "no such file"),
        ((), "Give one of --find"),
    ],
)
def test_a_bad_word_is_one_line_and_no_file(words: tuple[str, ...], says: str, lios: Run, tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    code, _, err = lios("record", *words, "-o", log)
    assert code == 2
    assert err.count("\n") == 1
    assert says in err
    assert not log.exists()


def test_an_output_that_exists_is_kept_unless_forced(lios: Run, tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    log.write_bytes(b"precious")
    code, _, err = lios("record", "--find", "mug", "-o", log)
    assert (code, log.read_bytes()) == (2, b"precious")
    assert "--force" in err
    assert lios("record", "--find", "mug", "-o", log, "--force")[0] == 0
    assert read(log).complete


@pytest.mark.parametrize(
    ("first", "second"),
    [("hold: Mug, to: start", "hold: Bowl, to: start"), ("hold: Mug, to: start", "hold: Mug, to: Fridge")],
    ids=["two things in one hand", "one thing in two places"],
)
def test_goals_that_contradict_each_other_end_with_a_proof(
    first: str, second: str, lios: Run, tmp_path: Path
) -> None:
    task, log = tmp_path / "task.yaml", tmp_path / "run.mcap"
    task.write_text(f"name: both\ngoal:\n  all:\n    - {{{first}}}\n    - {{{second}}}\n", encoding="utf-8")
    code, out, _ = lios("record", "--task", task, "--strategy", "lios", "-o", log, "--json")
    assert code == 0
    assert json.loads(out)["status"] == "no-plan"
    assert lios("doctor", log)[0] == 0


def test_a_planner_that_breaks_is_a_status_a_whole_log_and_exit_code_1(
    lios: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "planner_that_raises.py").write_text(
        'class Mine:\n    name = "mine"\n    def relevant_types(self, task): return ("Mug",)\n'
        '    def decide(self, view): raise ValueError("out of ideas")\n',
        encoding="utf-8",
    )
    monkeypatch.syspath_prepend(tmp_path)
    log = tmp_path / "run.mcap"
    code, out, err = lios("record", "--find", "mug", "-s", "planner_that_raises:Mine", "-o", log, "--json")
    answer = json.loads(out)
    assert code == 1
    assert (answer["status"], answer["reason"]) == ("planner-failed", "it raised ValueError: out of ideas")
    assert err == "lios: planner_that_raises:Mine broke: it raised ValueError: out of ideas\n"
    assert read(log).complete


@pytest.mark.parametrize("place", ["paper_home:A", "flat.yaml"])
def test_sizes_of_assets_are_refused_for_a_place_with_its_own(
    place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.run(["new", "house", "flat"]) == 0
    words = ["record", "--house", place, "--find", "Mug", "--assets", "nowhere.csv", "-o", "run.mcap"]
    assert cli.run(words) == 2
    assert "--assets is 'nowhere.csv'; it must be left out" in capsys.readouterr().err
