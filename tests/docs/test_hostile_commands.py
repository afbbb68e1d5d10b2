"""Mistyped commands give one line that says what is wrong, and the exit code of bad input."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from shutil import copytree

import pytest
from console_blocks import ROOT

from workbench import cli
from workbench.worlds.sites.site import shipped_sites

LOG = ROOT / "logs" / "find-lios.mcap"
WRONG = (
    "record --find mug --seed -1",
    "evaluate search --sees 2 --miss-rate 0.2 --policies conditioned-lios@start-over",
    "evaluate tasks --memory --sees 2.5",
    "evaluate search --rates rates.yaml",
    "record --find mug --known nan",
    "record --find unobtainium",
    "record --find mug --scenario deliver-3",
    "record --task folder",
    "record --find mug --house noise",
    "record --find mug --house folder",
    "plan LOG --at nan",
    "plan LOG --budget inf",
    "replay LOG --strategies ''",
    "replay LOG --strategies ,",
    "replay LOG --timeout nan",
    "replay LOG --seed -1",
    "compare folder",
    "report folder",
    "houses info folder",
    "houses info noise",
    "houses stats noise",
    "evaluate belief --seed -1",
    "evaluate belief --estimators ''",
    "evaluate belief --figures noise",
    "evaluate search --workers 0",
    "evaluate replay --strategies ''",
    "evaluate replay --strategies nope,lios",
    "evaluate perception nowhere.mcap",
    "evaluate perception logs --by colour",
    "evaluate perception noise",
    "log convert LOG -o run.jsonl --compression none",
    "log convert LOG -o run.jsonl --chunk-size 1000",
    "new planner class",
    "evaluate replay --strategies lios",
    "evaluate replay --scenarios nope",
    "evaluate spot --strategies ''",
    "train --houses noise",
    "view LOG --at nan",
    "render LOG --at inf",
    "render LOG -o frame.gif",
    "render LOG --video -o film.png",
    "info folder",
    "info noise",
    "recover ''",
    "compare noise",
    "plan LOG -o noise",
    "export LOG -o noise",
    "figures LOG -o noise",
    "site from-log LOG -o noise",
    "evaluate tasks --scenarios deliver-1 -n 1 -o noise",
    "evaluate replay -n 1 -o folder --force",
    "record --find mug -o folder --force",
    "capsule LOG -o noise --force",
    "record --find mug --house houses:-1",
    "record --find mug --house houses:99",
    "evaluate search --queries 1 --policies json:dumps",
    "evaluate search --queries 1 --policies :f",
    "evaluate spot --images-hz -1",
    "spot check --robot 127.0.0.1:9 --site paper_home --images-hz -1",
    "spot simulate --port 99999",
    "spot simulate --for -1",
)


@pytest.mark.parametrize("line", WRONG)
def test_one_line_and_exit_2(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "noise").write_bytes(bytes(range(255, 0, -1)))
    assert cli.run(shlex.split(line.replace("LOG", str(LOG)))) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("lios: ")
    assert len(said.err.strip().splitlines()) == 1, said.err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["folder", "noise"], "it left something behind"


TAKES_A_PLANNER = (
    "record --find mug --strategy lacking:Planner -o run.mcap",
    "replay LOG --strategies lacking:Planner",
    "replay LOG --strategies lacking:Planner --in-process",
    "plan LOG --strategy lacking:Planner",
    "select LOG --strategies lacking:Planner,lios",
    "evaluate tasks --strategies lacking:Planner -n 1 -o trials.csv",
    "evaluate replay --strategies lacking:Planner,lios -n 1",
    "evaluate search --policies lacking:Planner --queries 1",
    "evaluate belief --estimators lacking:Planner",
    "spot run --strategy lacking:Planner --robot 127.0.0.1:9 --site paper_home",
)


@pytest.mark.parametrize("line", TAKES_A_PLANNER)
def test_a_planner_that_imports_what_is_not_there(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lacking.py").write_text("import nothing_of_the_kind\n\nclass Planner: ...\n")
    assert cli.run(shlex.split(line.replace("LOG", str(LOG)))) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert "No module named 'nothing_of_the_kind'" in said.err
    assert len(said.err.strip().splitlines()) == 1, said.err
    assert {p.name for p in tmp_path.iterdir()} <= {"lacking.py", "__pycache__"}, "it left something behind"


def test_a_folder_without_an_evaluation_says_how_to_make_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["report", str(tmp_path)]) == 2
    assert "lios evaluate tasks" in capsys.readouterr().err


@pytest.fixture(scope="module")
def evaluation(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("kept") / "evaluation"
    line = f"evaluate tasks --scenarios deliver-3 -n 1 --strategies opt-greedy -o {folder}"
    assert cli.run(shlex.split(line)) == 0
    return folder


@pytest.mark.parametrize("content", [b'{"name": "\xc7"}', b"[" * 100_000, b'{"nobody": ' + b"[" * 100_000])
@pytest.mark.parametrize("file", ["settings.json", "trials.jsonl"])
def test_kept_results_that_are_no_text_or_nest_for_ever(
    file: str, content: bytes, evaluation: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "evaluation"
    copytree(evaluation, folder)
    (folder / file).write_bytes(content + b"\n")
    for line in (
        f"report {folder}",
        f"evaluate tasks --scenarios deliver-3 -n 2 --strategies opt-greedy -o {folder}",
    ):
        assert cli.run(shlex.split(line)) == 2
        told = capsys.readouterr().err
        assert told.startswith(f"lios: {folder / file}")
        assert len(told.splitlines()) == 1


def test_a_name_with_a_line_break_stays_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    copytree(shipped_sites()["paper_home"].parent, tmp_path / "home")
    with (tmp_path / "home" / "site.yaml").open("a") as site:
        site.write('\ntravel: {locations: ["start", "a\\nb"], metres: [[0, 1], [1, 0]]}\n')
    assert cli.run(["site", "check", str(tmp_path / "home" / "site.yaml")]) == 2
    told = capsys.readouterr().err
    assert "travel names a b" in told
    assert len(told.splitlines()) == 1


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ("-s greedy,lios --worlds 0", "no look is advised: what a look would show is judged by drawn worlds"),
        ("-s lios --worlds 5", "no look is advised: no strategy looks into a container that was left unopened"),
        ("-s greedy --worlds 5", "find-lios.mcap: no look would change what is known of these strategies"),
    ],
)
def test_where_no_look_helps_none_is_named(options: str, why: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["replay", str(LOG), "--look-next", *options.split()]) == 0
    said = capsys.readouterr()
    assert why in said.out + said.err
    assert "look into" not in said.out


def test_ranges_stay_in_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["plan", "--help"]) == 0
    assert "x>=0.0" in " ".join(capsys.readouterr().out.split())


def test_a_log_is_never_taken_for_an_output(tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    log.write_bytes(LOG.read_bytes())
    assert cli.run(["capsule", str(log), "-o", str(log), "--force"]) == 2
    assert log.read_bytes() == LOG.read_bytes()


@pytest.mark.ci_but(1)
@pytest.mark.parametrize("solver", ["up-nothing", "command:false {domain} {problem} {plan}"])
def test_a_solver_that_finds_nothing_is_no_success(solver: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["plan", str(LOG), "--solver", solver]) == 1
    said = capsys.readouterr().out
    assert said.startswith("solver-failed: ")
    assert "cost" not in said


def test_a_solver_that_finds_nothing_has_no_cost_for_machines(capsys: pytest.CaptureFixture[str]) -> None:
    solver = "command:false {domain} {problem} {plan}"
    assert cli.run(["plan", str(LOG), "--solver", solver, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["cost"] is None


def test_a_plan_for_machines_holds_its_problem_if_asked(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["plan", str(LOG), "--json", "--pddl", "--sas"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["domain"].startswith("(define (domain")
    assert answer["problem"].startswith("(define (problem")
    assert answer["sas"].startswith("begin_version")


def test_a_plan_is_by_default_the_first_though_nothing_was_known_at_the_start(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """find-lios.mcap: decisions after 0, 4.7, 7.7 s; the first look ends at 4.7 s."""
    for asked, decision in (((), 1), (("--at", "0"), 1), (("--at", "5"), 2)):
        assert cli.run(["plan", str(LOG.with_name("find-lios.mcap")), *asked, "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["decision"] == decision


def test_runs_are_listed_by_the_papers_names_too(capsys: pytest.CaptureFixture[str]) -> None:
    counts = []
    for name in ("model-lios", "ModelLIOS"):
        assert cli.run(["list", str(LOG.parent), "--strategy", name, "--json"]) == 3, "one of them was cut off"
        counts.append(len(json.loads(capsys.readouterr().out)["rows"]))
    assert counts[0] == counts[1] > 0
