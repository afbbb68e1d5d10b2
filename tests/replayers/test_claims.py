"""Claims of `lios compare --fail-if`: their form, what shows them, the exit code and the JUnit file."""

from __future__ import annotations

import json
from math import inf
from pathlib import Path
from xml.etree import ElementTree

import pytest
from toy_logs import simulated_log

import replayers
from replayers.batch.claims import Claim, judge, junit_xml, parse_claim
from replayers.batch.compare import StrategyComparison
from workbench import cli
from workbench.errors import BadValue, UnknownName
from workbench.evaluation.statistics import IntervalEstimate


def pair(*, least: float, most: float, drawn: IntervalEstimate | None = None, logs: int = 3) -> StrategyComparison:
    return StrategyComparison(
        a="model-lios", b="opt-greedy", logs=logs, houses=1, wins=0, loses=0, equal=0, undecided=logs,
        least=least, most=most, chance=None, drawn=drawn, true=None, differences=(),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "dearer", "cheaper", "evidence"),
    [
        ("lios > greedy", "model-lios", "opt-greedy", "interval"),
        ("greedy<lios by bounds", "model-lios", "opt-greedy", "bounds"),
        ("lios by counts > greedy by best", "model-lios by counts", "opt-greedy by best", "interval"),
        ("lios by counts<greedy by best by bounds", "opt-greedy by best", "model-lios by counts", "bounds"),
        (" my_planner:Mine > scout-lios by interval ", "my_planner:Mine", "scout-lios", "interval"),
    ],
)
def test_forms(text: str, dearer: str, cheaper: str, evidence: str) -> None:
    claim = parse_claim(text)
    assert (claim.dearer, claim.cheaper, claim.evidence) == (dearer, cheaper, evidence)


@pytest.mark.parametrize("text", ["", "lios", "lios = greedy", "lios > greedy by luck", "a > b > c d"])
def test_other_forms_are_refused(text: str) -> None:
    with pytest.raises(BadValue, match="--fail-if"):
        parse_claim(text)


@pytest.mark.parametrize(
    ("claim", "least", "most", "holds", "ends"),
    [
        ("lios > greedy by bounds", 0.5, 2.0, True, (0.5, 2.0)),
        ("lios > greedy by bounds", 0.0, 2.0, False, (0.0, 2.0)),
        ("greedy > lios by bounds", 0.5, 2.0, False, (-2.0, -0.5)),
        ("greedy > lios by bounds", -inf, -0.1, True, (0.1, inf)),
    ],
)
def test_by_bounds_it_must_hold_in_every_world(
    claim: str, least: float, most: float, holds: bool, ends: tuple[float, float]
) -> None:
    judged = judge(parse_claim(claim), [pair(least=least, most=most)])
    assert (judged.holds, (judged.low, judged.high)) == (holds, ends)


def test_one_log_shows_nothing_by_interval() -> None:
    assert not judge(parse_claim("lios > greedy"), [pair(least=1.0, most=2.0, logs=1)]).holds


def test_strategies_that_were_not_replayed_are_told() -> None:
    with pytest.raises(UnknownName, match="scout-lios"):
        judge(parse_claim("lios > scout-lios"), [pair(least=0.0, most=1.0)])


def test_junit_escapes_and_counts() -> None:
    claim = Claim(text='a<"&>', dearer="model-lios", cheaper="opt-greedy", evidence="bounds")
    judged = [judge(claim, [pair(least=1.0, most=2.0)]), judge(claim, [pair(least=-1.0, most=2.0)])]
    root = ElementTree.fromstring(junit_xml(judged))
    assert (root.get("tests"), root.get("failures")) == ("2", "1")
    cases = root.findall("./testsuite/testcase")
    assert [case.get("name") for case in cases] == ['not a<"&>'] * 2
    assert [case.find("failure") is not None for case in cases] == [True, False]


def test_the_command_exits_with_1_where_it_is_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = simulated_log(tmp_path / "run.mcap", name="opt-greedy")
    kept = tmp_path / "kept"
    replayers.replay(log, "greedy,lios", settings=replayers.ReplaySettings(worlds=20), output=kept)
    (compared,) = replayers.compare(kept)
    line = ["compare", str(kept), "--json", "--junit", str(tmp_path / "claims.xml"), "--fail-if"]
    for claim, low in (("greedy > lios by bounds", compared.least), ("lios > greedy by bounds", -compared.most)):
        assert cli.run([*line, claim]) == (1 if low > 0 else 0)
        (told,) = json.loads(capsys.readouterr().out)["claims"]
        assert told["holds"] == (low > 0)
        assert ElementTree.parse(tmp_path / "claims.xml").getroot().get("failures") == str(int(low > 0))
    assert cli.run(["compare", str(kept), "--junit", str(tmp_path / "x.xml")]) == 2
    assert cli.run([*line, "lios ? greedy"]) == 2
