"""Verdicts of the checker over certificates of several strategies: who is compared, on which trials, and how."""

from __future__ import annotations

import json
import random
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from replayers.certificates.claim import seal_of, write_claim
from replayers.runs.run import Run, read
from workbench.cli import run as lios

sys.path.insert(0, str(Path(__file__).parent))
from claims_made import LOGS, checker, claimed, facts, written

HOMES = tuple(f"spot-home-{letter}" for letter in "ABCD")


def said(paths: list[str], capsys: pytest.CaptureFixture[str], code: int = 0) -> list[str]:
    """The verdicts, below a line for each certificate."""
    capsys.readouterr()
    assert checker().main(paths) == code
    return [line for line in capsys.readouterr().out.splitlines() if ".lios.zip: " not in line]


def forged(path: str, **changes: Any) -> str:
    """A certificate with some fields changed, and sealed again, beside the true one."""
    values = json.loads(claimed(*changes.pop("of")))
    values |= changes
    values["seal"] = seal_of(values)
    write_claim(Path(path), values)
    return path


def test_strategies_are_compared_world_by_world(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As docs/select.md says: 1.6 or more, though the costs over home A overlap (28.54 to 74.38, 19.54 to 74.29)."""
    [line] = said(written(tmp_path, HOMES, ("pes-greedy", "pes-lios")), capsys)
    assert line.startswith("pes-greedy (")
    assert ") beats pes-lios (" in line
    assert "by 1.62 or more on 4 trials in sum, in every world" in line
    assert all(facts(log).name in line for log in HOMES)


def test_a_weaker_certificate_takes_nothing_from_a_stronger_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = written(tmp_path, HOMES, ("pes-greedy", "conditioned-lios"))
    weak = str(tmp_path / "weak.lios.zip")
    write_claim(Path(weak), json.loads(claimed("spot-home-A", "pes-greedy", 1)))
    alone = said(paths, capsys)
    assert "pes-greedy" in alone[0].partition(" beats ")[0]
    assert said([*paths, weak], capsys) == said([weak, *paths], capsys) == alone


def test_certificates_that_contradict_each_other_count_for_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = written(tmp_path, ("spot-home-C", "spot-home-D"), ("pes-greedy", "conditioned-lios"))
    false = forged(str(tmp_path / "false.lios.zip"), of=("spot-home-C", "pes-greedy"), strategy="conditioned-lios")
    for given in ([*paths, false], [false, *paths]):
        [line] = said(given, capsys, code=1)
        assert "on 1 trial, in every world" in line
        left_out = line.partition("left out")[2]
        assert f"{facts('spot-home-C').name} (a certificate was refused)" in left_out
        checker().main(given)
        refused = [one for one in capsys.readouterr().out.splitlines() if ": refused: " in one]
        assert len(refused) == 1
        assert "no world agrees with it and with" in refused[0]


def test_one_strategy_by_two_estimators_or_releases_is_two(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, paths = str(LOGS / "spot-home-C.mcap"), [str(tmp_path / f"{name}.lios.zip") for name in ("own", "counts")]
    assert lios(["certify", log, "-s", "conditioned-lios", "-o", paths[0]]) == 0
    capsys.readouterr()
    assert lios(["certify", log, "-s", "conditioned-lios", "--estimator", "counts", "-o", paths[1], "--json"]) == 0
    counted = json.loads(capsys.readouterr().out)["estimator"]
    assert counted.startswith("counts@")
    [line] = said([log, *paths], capsys)
    assert f", {counted})" in line
    older = forged(str(tmp_path / "old.lios.zip"), of=("spot-home-C", "pes-greedy"), strategy_version="0.0.1")
    newer = forged(str(tmp_path / "new.lios.zip"), of=("spot-home-C", "pes-greedy"))
    [line] = said([log, older, newer], capsys)
    assert "neither of pes-greedy (0.0.1, " in line


def test_a_belief_that_is_held_is_another_than_one_that_follows_what_is_seen(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, certified = str(tmp_path / "run.mcap"), dict[str, str]()
    house = ["record", "--house", "houses:1", "--scenario", "deliver-2", "-s", "conditioned-lios"]
    assert lios([*house, "--estimator", "best", "--seed", "1", "-o", log]) == 0
    for who in ("log", "first"):
        out = str(tmp_path / f"{who}.lios.zip")
        capsys.readouterr()
        assert lios(["certify", log, "-s", "conditioned-lios", "--estimator", who, "-o", out, "--json"]) == 0
        certified[who] = json.loads(capsys.readouterr().out)["estimator"]
    assert certified["first"] == f"{certified['log']} (first belief held)"


def test_the_trials_that_a_verdict_rests_on_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    paths = written(tmp_path, HOMES, ("pes-greedy", "conditioned-lios"))
    rest, last = paths[:-1], Path(paths[-1])
    for given, code in ((rest, 0), (paths, 1)):  # the last one missing, then tampered with
        last.write_bytes(last.read_bytes().replace(b"claim", b"clain"))
        [line] = said(given, capsys, code)
        rests_on, left_out = line.split("; left out, for lack of a certificate of both: ")
        assert [facts(log).name in rests_on for log in HOMES] == [True, True, True, False]
        assert facts("spot-home-D").name in left_out
    forged(str(last := tmp_path / "false.lios.zip"), of=("spot-home-D", "conditioned-lios"), failure_cost=1.0)
    assert said([*rest, str(last)], capsys, 1)[0].endswith(f"{facts('spot-home-D').name} (a certificate was refused)")


def test_strategies_without_a_common_trial_are_not_compared(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one = written(tmp_path, ("spot-home-C",), ("pes-greedy",))
    [line] = said([*one, *written(tmp_path, ("spot-home-D",), ("pes-lios",))], capsys)
    assert " have no trial in common; left out" in line


def cost_in(tree: Any, world: dict[str, dict[str, int]], failure: float) -> float:
    """What the run of a certificate's tree costs where unopened containers hold so many of each type."""
    spent, most = 0.0, {"CellPhone": 1, "WaterBottle": 1}
    while True:
        spent += sum(step["cost"] for step in tree.get("steps", []))
        if "end" in tree:
            return spent if tree["end"]["done"] else failure
        look = tree["look"]
        spent += look["cost"]
        answer = [t for t in look["live"] for _ in range(min(most[t], world[look["container"]][t]))]
        [tree] = [a["then"] for a in look["answers"] if [item["type"] for item in a["items"]] == answer]


def test_no_world_gives_less_than_the_least_gap_and_one_gives_it() -> None:
    log, rng = facts("spot-home-A"), random.Random(0)
    claims = [json.loads(claimed("spot-home-A", name)) for name in ("pes-greedy", "pes-lios")]
    ends = [checker().check(claim, {log.sha256: log})[2] for claim in claims]
    gaps: list[float] = []
    for _ in range(4000):
        world = {c: {t: rng.choice((0, 0, 0, 1, 2)) for t in ("CellPhone", "WaterBottle")} for c in sorted(log.open)}
        greedy, other = (cost_in(claim["tree"], world, log.failure) for claim in claims)
        gaps.append(other - greedy)
    assert checker().least_gap(*ends) == pytest.approx(min(gaps))
    assert checker().least_gap(ends[1], ends[0]) == pytest.approx(-max(gaps))


def test_ends_agree_unless_a_type_that_matters_on_both_ways_differs() -> None:
    def agree(one: Any, other: Any) -> bool:
        return checker().least_gap([(0.0, 0.0, one)], [(0.0, 0.0, other)]) == 0.0

    assert agree({"bed": (["A"], ["A"])}, {"bed": (["B"], [])})
    assert agree({"bed": (["A"], ["A"])}, {"desk": (["A"], [])})
    assert agree({"bed": (["A", "B"], ["A", "A", "B"])}, {"bed": (["A"], ["A", "A"])})
    assert not agree({"bed": (["A"], ["A"])}, {"bed": (["A", "B"], ["B"])})
    assert not agree({"bed": (["A"], ["A"])}, {"bed": (["A"], ["A", "A"])})


@pytest.mark.parametrize("version", [True, 2.0, "2", 1, None])
def test_another_version_is_refused(version: object, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = forged(str(tmp_path / "claim.lios.zip"), of=("spot-home-C", "pes-greedy"), version=version)
    assert checker().main([path, str(LOGS / "spot-home-C.mcap")]) == 1
    assert f"refused: it is of version {version}" in capsys.readouterr().out


def test_where_no_planner_drove_a_strategy_has_to_be_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def imported(path: Path) -> Run:
        run = read(path)
        return replace(run, info=structs.replace(run.info, strategy="recorded"))

    monkeypatch.setattr("replayers.runs.run.read", imported)
    assert lios(["certify", str(LOGS / "find-greedy.mcap"), "-o", str(tmp_path / "claim.lios.zip")]) == 2
    words = capsys.readouterr().err
    assert "-s model-lios" in words
    assert "Did you mean" not in words
