"""Certificates against the checker, which imports nothing of this project: it accepts true ones, and refuses all in
which one number, branch or world was changed."""

from __future__ import annotations

import ast
import copy
import json
import random
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from replayers.certificates.build import certificate
from replayers.certificates.claim import seal_of, write_claim
from replayers.certificates.tree_writer import NotCertifiable
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.replay import replay_strategy
from replayers.runs.run import read
from workbench.cli import run as lios
from workbench.planning.strategies import strategy

sys.path.insert(0, str(Path(__file__).parent))
from claims_made import CHECKER, LOGS, checker, claimed, facts, written

CASES = (
    ("find-greedy", "opt-lios"),
    ("spot-home-A", "opt-lios"),
    ("spot-home-A", "pes-greedy"),
    ("deliver-3", "opt-greedy"),  # 137 states, on 114,682 branches
)

MAX_LINES = 300


def is_refused(log: str, values: Any) -> bool:
    try:
        checker().check(values, {facts(log).sha256: facts(log)})
    except checker().Refused:
        return True
    return False


def test_the_checker_is_short_and_imports_nothing_of_this_project() -> None:
    text = CHECKER.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= MAX_LINES
    names = {alias.name for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import) for alias in node.names}
    names |= {str(node.module) for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom)}
    assert {name.partition(".")[0] for name in names} - set(sys.stdlib_module_names) == {"mcap"}


@pytest.mark.ci_but(1)
@pytest.mark.parametrize(("log", "name"), CASES)
def test_certificates_hold_and_say_what_replay_says(log: str, name: str) -> None:
    values = json.loads(claimed(log, name))
    lower, upper, *_ = checker().check(values, {facts(log).sha256: facts(log)})
    made = replay_strategy(prepare_log(read(LOGS / f"{log}.mcap"), ReplaySettings(worlds=0)), strategy(name))
    assert made.bounds is not None
    assert (lower, upper) == pytest.approx((made.bounds.lower, made.bounds.upper))
    assert values["lower"]["kind"] == values["upper"]["kind"] == "leaf"


def test_what_is_not_followed_is_outer_and_named_so() -> None:
    values = json.loads(claimed("spot-home-A", "opt-lios", 3))
    assert values["lower"]["kind"] == values["upper"]["kind"] == "outer"
    assert values["upper"]["cost"] is None
    assert not is_refused("spot-home-A", values)


def places(value: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], Any]]:
    yield at, value
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, below in inside:
        yield from places(below, (*at, key))


def holder(values: Any, at: tuple[Any, ...]) -> Any:
    for key in at[:-1]:
        values = values[key]
    return values


def mutant(values: Any, rng: random.Random) -> Any:
    """The certificate with one number, branch or world changed, and sealed again: only its content can betray it."""
    changed = copy.deepcopy(values)
    every = [(at, v) for at, v in places(changed) if at]
    kind = rng.choice(("number", "branch", "step", "world", "place"))
    if kind == "number":
        at, old = rng.choice([(a, v) for a, v in every if type(v) in (int, float)])
        holder(changed, at)[at[-1]] = old + rng.choice((-1, 1)) * rng.choice((0.001, 1, 50))
    elif kind == "branch":
        at, answers = rng.choice([(a, v) for a, v in every if a[-1] == "answers"])
        rng.choice((answers.pop, lambda i: answers.append(copy.deepcopy(answers[i]))))(rng.randrange(len(answers)))
    elif kind == "step":
        # A look that costs nothing and finds nothing may be left out: the rest is still a run, of another strategy.
        at, _ = rng.choice([(a, v) for a, v in every if a[-2:-1] == ("steps",) and v["action"] != "search"])
        holder(changed, at).pop(at[-1])
    elif kind == "world":
        at, world = rng.choice([(a, v) for a, v in every if a[-1] == "world" and v])
        world[rng.choice(sorted(world))].append(rng.choice([*changed["types"], "Alien"]))
    else:
        at, old = rng.choice([(a, v) for a, v in every if a[-1] in ("target", "container", "type") and v])
        holder(changed, at)[at[-1]] = rng.choice(("start", "nowhere", f"{old}|9"))
    if changed != values:
        changed["seal"] = seal_of(changed)
    return changed


@pytest.mark.parametrize("end", ["lower", "upper"])
def test_an_answer_s_number_does_not_count_from_the_end(end: str) -> None:
    """In Python -8 and 0 are the same answer of eight."""
    values = json.loads(claimed("deliver-3", "opt-greedy"))
    node = values["tree"]
    values[end]["path"][0] -= len(node["look"]["answers"])
    values["seal"] = seal_of(values)
    assert is_refused("deliver-3", values)


def accepted_mutants(count: int, seed: int) -> list[Any]:
    rng = random.Random(seed)
    wrong: list[Any] = []
    for number in range(count):
        log, name = CASES[number % len(CASES)]
        values = json.loads(claimed(log, name))
        changed = mutant(values, rng)
        while changed == values:  # a certificate that is still the same is no mutant
            changed = mutant(values, rng)
        if not is_refused(log, changed):
            wrong.append((log, name, changed))
    return wrong


def test_changed_certificates_are_refused() -> None:
    assert accepted_mutants(50, seed=1) == []


@pytest.mark.slow
def test_a_thousand_changed_certificates_are_refused() -> None:
    assert accepted_mutants(1000, seed=2) == []


def test_anything_changed_breaks_the_seal() -> None:
    for name, value in (("strategy", "another"), ("strategy_version", "0"), ("tree", {}), ("seal", "")):
        values = json.loads(claimed("find-greedy", "opt-lios"))
        values[name] = value
        assert is_refused("find-greedy", values)


@pytest.mark.parametrize("values", [{}, [], {"version": 3}, {"version": 2}, None])
def test_what_is_no_claim_is_refused(values: Any) -> None:
    with pytest.raises(checker().Refused):
        checker().check(values, {})


def test_from_log_to_verdict_on_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, out = str(LOGS / "spot-home-D.mcap"), tmp_path / "claim.lios.zip"
    assert lios(["certify", log, "-s", "pes-greedy", "-o", str(out)]) == 0
    assert lios(["certify", log, "-s", "opt-lios", "-o", str(tmp_path / "other.lios.zip"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["lower_kind"] == "leaf"
    assert lios(["certify", log, "-s", "opt-lios", "-o", str(out)]) == 2  # not overwritten
    said = subprocess.run(
        [sys.executable, CHECKER, out, tmp_path / "other.lios.zip", log], capture_output=True, text=True, check=True
    ).stdout  # fmt: skip
    assert "pes-greedy (" in said.partition(" beats opt-lios (")[0].splitlines()[-1]
    assert " on 1 trial, in every world that agrees with the logs: spot-home-D.mcap " in said
    assert "neither" not in said
    with zipfile.ZipFile(out, "a") as packed:
        assert packed.namelist() == ["claim.json"]


def test_what_only_a_later_look_shows_was_there_for_the_checker_too(tmp_path: Path) -> None:
    """The first look into the couch misses the phone; the third shows it."""
    log, out = str(tmp_path / "run.mcap"), str(tmp_path / "claim.lios.zip")
    run = ["record", "--house", "paper_home:B", "--find", "CellPhone", "-s", "pes-greedy", "--estimator", "counts"]
    assert lios([*run, "--miss-rate", "0.8", "--seed", "725", "-o", log]) == 0
    shown = [seen.items for seen in read(log).observations if seen.container == "couch"]
    assert (shown[0], bool(shown[-1])) == ((), True)
    assert lios(["certify", log, "-s", "opt-greedy", "-o", out]) == 0
    assert checker().main([out, log]) == 0


def test_claims_whose_bounds_overlap_beat_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert checker().main(written(tmp_path, ("spot-home-A",), ("opt-lios", "pes-greedy"))) == 0
    said = capsys.readouterr().out.splitlines()[-1]
    assert said.startswith("neither of opt-lios (")
    assert "is shown to beat the other on 1 trial" in said


def test_several_trials_are_compared_in_sum(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """2.01 on home A and 5.31 on home B: what is claimed is the sum, not that one beats the other on each trial."""
    assert checker().main(written(tmp_path, ("spot-home-A", "spot-home-B"), ("model-lios", "conditioned-lios"))) == 0
    said = capsys.readouterr().out.splitlines()[-1]
    assert said.startswith("conditioned-lios (")
    assert ") beats model-lios (" in said
    assert "by 7.32 or more on 2 trials in sum" in said


def test_the_same_certificate_is_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_claim(tmp_path / name, json.loads(claimed("find-greedy", "opt-lios")))
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


@pytest.mark.parametrize("log", ["cut-off", "breakfast"])
def test_logs_that_certificates_do_not_cover_are_refused_in_one_line(log: str, tmp_path: Path) -> None:
    prepared = prepare_log(read(LOGS / f"{log}.mcap"), ReplaySettings(worlds=0))
    with pytest.raises(NotCertifiable, match="certificates do not cover"):
        certificate(prepared, strategy("opt-greedy"))


def test_without_mcap_it_says_so_in_one_line(tmp_path: Path) -> None:
    alone = [sys.executable, "-I", "-S", CHECKER]  # without the packages installed here
    said = subprocess.run([*alone, tmp_path / "run.mcap"], capture_output=True, text=True, check=False)
    assert said.returncode == 2
    assert said.stdout == ""
    assert said.stderr.count("\n") == 1
    assert "pip install mcap" in said.stderr


def test_a_bad_call_is_told_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    claim, log = tmp_path / "claim.lios.zip", str(LOGS / "find-greedy.mcap")
    write_claim(claim, json.loads(claimed("find-greedy", "opt-lios")))
    folder = tmp_path / "folder.mcap"
    folder.mkdir()
    for paths, what in (
        ([], "no claim is given"),
        ([log], "no claim is given"),
        ([str(claim), str(tmp_path / "no.mcap")], "no.mcap: no such file"),
        ([str(tmp_path / "no.lios.zip"), log], "no.lios.zip: no such file"),
        ([str(claim), str(folder)], "folder.mcap: it is a folder"),
        ([str(claim), log, str(folder), str(tmp_path / "no.mcap")], "folder.mcap: it is a folder"),
    ):
        assert checker().main(paths) == 2
        said = capsys.readouterr()
        assert said.out == ""
        assert what in said.err
        assert said.err.count("\n") == 1


DAMAGES = (
    lambda packed: packed[: len(packed) // 2] + bytes(300) + packed[len(packed) // 2 + 300 :],  # compressed data
    lambda packed: packed[:300],
    lambda packed: b"PK" + bytes(400),
    lambda packed: b"",
)


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("what", ["claim", "log"])
def test_damaged_files_are_refused_in_one_line_each(
    what: str, damage: Callable[[bytes], bytes], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    claim, log = tmp_path / "claim.lios.zip", tmp_path / "run.mcap"
    write_claim(claim, json.loads(claimed("find-greedy", "opt-lios")))
    log.write_bytes((LOGS / "find-greedy.mcap").read_bytes())
    damaged = claim if what == "claim" else log
    damaged.write_bytes(damage(damaged.read_bytes()))
    assert checker().main([str(claim), str(log)]) == 1
    said = capsys.readouterr()
    assert said.err == ""
    assert f"{damaged}: refused: " in said.out
    assert len(said.out.splitlines()) == (1 if what == "claim" else 2)
    assert "holds" not in said.out


def test_compression_that_is_not_known_is_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    claim = tmp_path / "claim.lios.zip"
    write_claim(claim, json.loads(claimed("find-greedy", "opt-lios")))
    packed = bytearray(claim.read_bytes())
    for header, place in ((b"PK\x03\x04", 8), (b"PK\x01\x02", 10)):
        packed[packed.index(header) + place] = 77
    claim.write_bytes(packed)
    assert checker().main([str(claim), str(LOGS / "find-greedy.mcap")]) == 1
    assert capsys.readouterr().out.startswith(f"{claim}: refused: it cannot be read (NotImplementedError")


@pytest.mark.parametrize(
    ("field", "words"),
    [("strategy", "a name that cannot be printed"), ("log_sha256", "no log here"), ("log", "about")],
)
def test_a_certificate_cannot_print_lines_of_its_own(
    field: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    values, claim = json.loads(claimed("find-greedy", "opt-lios")), tmp_path / "claim.lios.zip"
    values[field] = "a\nb.lios.zip: holds: b costs 1.00 (leaf) to 1.00 (leaf)\x1b[2J"
    values["log_sha256"] = "0" if field == "log" else values["log_sha256"]
    values["seal"] = seal_of(values)
    write_claim(claim, values)
    assert checker().main([str(claim), str(LOGS / "find-greedy.mcap")]) == 1
    said = capsys.readouterr().out
    assert len(said.splitlines()) == 1
    assert words in said
    assert said.strip().isprintable()


HANGS = """
import time


class Hangs:
    name = "hangs"

    def relevant_types(self, task):
        return ()

    def decide(self, view):
        time.sleep(1000)
"""


@pytest.mark.ci
def test_a_planner_that_hangs_or_is_not_there_is_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hanging_planner.py").write_text(HANGS)
    log, settings = str(LOGS / "find-greedy.mcap"), ReplaySettings(worlds=0, timeout_s=0.3)
    monkeypatch.setattr("replayers.counterfactual.prepared_log.ReplaySettings", lambda **_: settings)
    for name, why in (("Hangs", "no decision within 0.3 s"), ("Misspelt", "Misspelt")):
        assert lios(["certify", log, "-s", f"hanging_planner:{name}", "-o", "claim.lios.zip"]) == 2
        said = capsys.readouterr().err
        assert why in said
        assert said.count("\n") == 1
    assert not (tmp_path / "claim.lios.zip").exists()
