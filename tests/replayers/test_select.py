"""`lios select` over real logs: groups, a table, JSON, and what is left out."""

from __future__ import annotations

import json
import re
from pathlib import Path
from shutil import copy

import pytest

from workbench.cli import run as lios

LOGS = Path(__file__).resolve().parents[2] / "logs"
FINDS = [str(LOGS / f"find-{name}.mcap") for name in ("greedy", "lios", "conditioned-lios")]
BREAKS = """
from workbench.planning.strategies import strategy


class Some:
    name = "some"

    def relevant_types(self, task):
        return strategy("model-lios").relevant_types(task)

    def decide(self, view):
        if view.task.scenario == "find":
            raise RuntimeError("no idea")
        return strategy("model-lios").decide(view)
"""
QUICK = ["-s", "greedy,lios", "--worlds", "10"]


PAGES = LOGS.parent / "docs"


def selected(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, object]:
    assert lios(["select", *arguments, *QUICK, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_one_log_is_one_trial(capsys: pytest.CaptureFixture[str]) -> None:
    answer = selected(capsys, FINDS[0], "--look-next")
    (group,) = answer["groups"]  # type: ignore[misc]
    assert [after["trials"] for after in group["after"]] == [1]
    assert group["settled"] is None
    assert group["next"] in {row["strategy"] for row in group["after"][0]["rows"]}
    assert answer["look_next"]


def test_logs_of_other_tasks_are_other_groups(capsys: pytest.CaptureFixture[str]) -> None:
    answer = selected(capsys, *FINDS, str(LOGS / "spot-home-D.mcap"))
    names = {group["group"]: len(group["logs"]) for group in answer["groups"]}  # type: ignore[attr-defined]
    assert names == {"find, in simulation": 3, "deliver-2, by spot": 1}


@pytest.mark.slow
def test_tables_say_what_to_drive_and_why(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    figure = tmp_path / "selection.png"
    assert lios(["select", FINDS[0], FINDS[1], *QUICK, "--figure", str(figure)]) == 0
    shown = capsys.readouterr()
    assert "drive next" in shown.out
    assert "On the trials so far it cost at most" in shown.out
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_kinds_of_trial_are_told_apart_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert lios(["select", FINDS[0], str(LOGS / "spot-home-D.mcap"), *QUICK]) == 0
    said = capsys.readouterr()
    assert "These logs are of 2 kinds of trial; each has its own answer" in said.err
    assert "find, in simulation: 1 trial in 1 place" in said.out
    assert "deliver-2, by spot: 1 trial in 1 place" in said.out


@pytest.mark.slow
def test_a_strategy_that_breaks_on_some_logs_proves_nothing_there(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "breaks_on_some.py").write_text(BREAKS)
    monkeypatch.chdir(tmp_path)
    wish = ["select", *FINDS[:2], str(LOGS / "spot-home-D.mcap"), "-s", "breaks_on_some:Some,lios", "--worlds", "5"]
    assert lios([*wish, "--json"]) == 3
    groups = {group["group"]: group for group in json.loads(capsys.readouterr().out)["groups"]}
    (broke,) = groups["find, in simulation"]["broke"]
    assert broke["strategy"] == "some"
    assert broke["logs"] == ["find-greedy.mcap", "find-lios.mcap"]
    assert "no idea" in broke["reason"]
    assert groups["find, in simulation"]["next"] == "model-lios"
    assert groups["find, in simulation"]["after"][-1]["by_proof"] == []
    assert groups["deliver-2, by spot"]["broke"] == []
    assert lios(wish) == 3
    said = capsys.readouterr()
    assert "left out of the choice: some broke on 2 of 2 logs: it raised RuntimeError: no idea" in said.err
    assert "Drive model-lios next: no other candidate ran" in said.out


def test_logs_that_cannot_be_read_are_left_out_in_one_line_each(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    copy(FINDS[0], tmp_path)
    (tmp_path / "junk.mcap").write_bytes(b"hello")
    (tmp_path / "cut.mcap").write_bytes(Path(FINDS[1]).read_bytes()[:3000])
    assert lios(["select", str(tmp_path), *QUICK]) == 3
    left_out = [line for line in capsys.readouterr().err.splitlines() if line.startswith("left out: ")]
    assert len(left_out) == 2
    assert "junk.mcap: it is no MCAP file" in left_out[1]
    assert lios(["select", str(tmp_path / "junk.mcap"), *QUICK]) == 2
    assert "no log can be compared" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-s", "lios"], "two or more"),
        (["-s", "lios,greedy", "--group-by", "weather"], "scenario, site, task"),
        (["-s", "lios,nobody"], "nobody"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert lios(["select", FINDS[0], "--worlds", "0", *arguments]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert words in said[-1]


def test_a_log_that_cannot_be_read_is_left_out_and_told(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "torn.mcap").write_bytes(b"\x89MCAP0\r\nnothing")
    code = lios(["select", FINDS[0], str(tmp_path / "torn.mcap"), *QUICK, "--json"])
    shown = capsys.readouterr()
    assert code == 3
    assert [log for log in json.loads(shown.out)["left_out"] if "torn.mcap" in log]


@pytest.mark.slow
def test_a_strategy_that_breaks_on_some_logs_is_told_and_proves_nothing(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "breaks_sometimes.py").write_text(
        "from workbench.planning.strategies import strategy\n"
        "class Planner:\n"
        "    name = 'breaks-sometimes'\n"
        "    def __init__(self):\n"
        "        self.inner = strategy('greedy')\n"
        "    def relevant_types(self, task):\n"
        "        return self.inner.relevant_types(task)\n"
        "    def decide(self, view):\n"
        "        if view.task.scenario != 'find':\n"
        "            raise RuntimeError('no such task here')\n"
        "        return self.inner.decide(view)\n"
    )
    code = lios(["select", FINDS[0], str(LOGS / "spot-home-D.mcap"), "-s", "greedy,breaks_sometimes:Planner",
                 "--worlds", "5", "--json"])  # fmt: skip
    shown = capsys.readouterr()
    assert code == 3, shown.err
    groups = {group["group"]: group for group in json.loads(shown.out)["groups"]}
    broke = groups["deliver-2, by spot"]["broke"]
    assert [b["logs"] for b in broke] == [["spot-home-D.mcap"]]
    assert groups["deliver-2, by spot"]["next"] != broke[0]["strategy"]


@pytest.mark.parametrize(
    ("figure", "words"), [(".", "a file is needed"), ("x.xyz", "ends in .png"), ("x", "ends in .png")]
)
def test_a_figure_that_cannot_be_written_is_refused_before_anything_is_replayed(
    figure: str, words: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert lios(["select", FINDS[0], *QUICK, "-o", "kept", "--figure", figure]) == 2
    shown = capsys.readouterr()
    assert words in shown.err
    assert len(shown.err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_a_figure_is_replaced_by_force_alone(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    figure = tmp_path / "x.png"
    figure.write_bytes(b"mine")
    wish = ["select", FINDS[0], *QUICK, "--figure", str(figure)]
    assert lios(wish) == 2
    assert "--force" in capsys.readouterr().err
    assert figure.read_bytes() == b"mine"
    assert lios([*wish, "--force"]) == 0
    assert figure.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("option", ["-o", "--figure"])
def test_a_folder_that_cannot_be_made_is_bad_input(option: str, capsys: pytest.CaptureFixture[str]) -> None:
    place = "/proc/lios" if option == "-o" else "/proc/lios/x.png"
    assert lios(["select", FINDS[0], *QUICK, option, place]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("lios: /proc/lios: this folder cannot be made: ")


def test_without_drawn_worlds_what_is_expected_is_named_the_middle(capsys: pytest.CaptureFixture[str]) -> None:
    wish = ["select", FINDS[0], "-s", "pes-greedy,lios"]
    assert lios([*wish, "--worlds", "0"]) == 0
    assert "(middle)" in capsys.readouterr().out
    assert lios([*wish, "--worlds", "5"]) == 0
    assert "(middle)" not in capsys.readouterr().out


def test_a_copy_under_another_name_is_no_further_trial(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    copy(FINDS[0], tmp_path / "again.mcap")
    answer = selected(capsys, FINDS[0], str(tmp_path / "again.mcap"))
    (group,) = answer["groups"]  # type: ignore[misc]
    assert len(group["logs"]) == 1
    assert answer["left_out"] == ["find-greedy.mcap, again.mcap are of one run and say the same; it counts once"]


def test_a_horizon_that_has_passed_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert lios(["select", FINDS[0], FINDS[1], *QUICK, "--horizon", "1"]) == 2
    assert "at least the 2 trials so far" in capsys.readouterr().err


def keys(value: object) -> set[str]:
    """The keys of a JSON value and of all in it."""
    inside = list(value.values()) if isinstance(value, dict) else value if isinstance(value, list) else []
    return (set(value) if isinstance(value, dict) else set()).union(*(keys(v) for v in inside))


def test_the_pages_explain_every_key_of_the_json(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken_on_finds.py").write_text(BREAKS)
    monkeypatch.syspath_prepend(str(tmp_path))
    arguments = [*FINDS[:2], "-s", "greedy,lios,broken_on_finds:Some", "--worlds", "10", "--look-next", "--json"]
    assert lios(["select", *arguments]) == 3
    answer = json.loads(capsys.readouterr().out)
    explained = set(re.findall(r"`(\w+)`", (PAGES / "select.md").read_text(encoding="utf-8").partition("## JSON")[2]))
    assert keys(answer) - {"after"} <= explained
    assert lios(["certify", FINDS[0], "-o", "claim.lios.zip", "--json"]) == 0
    page = (PAGES / "certificates.md").read_text(encoding="utf-8")
    assert keys(json.loads(capsys.readouterr().out)) <= set(re.findall(r"`(\w+)`", page))
