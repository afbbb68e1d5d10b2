"""The doctor, the list and replay agree on what is missing from a run of which a filter left a part."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from replayers.doctor.examine import examine
from replayers.doctor.findings import Level, Verdict
from workbench import cli

LOG = Path(__file__).parents[2] / "logs" / "find-conditioned-lios.mcap"


@pytest.mark.parametrize(
    ("kept", "verdict"),
    [
        (["-S", "10", "-E", "60"], Verdict.LOSSY),
        (["-E", "15"], Verdict.LOSSY),
        (["-n", "/search/observation"], Verdict.LOSSY),
        (["-n", "/search/action"], Verdict.LOSSY),
        (["-n", "/robot/.*"], Verdict.FINE),
        (["-n", "/search/(plan|belief|find_cost)"], Verdict.FINE),
    ],
    ids=" ".join,
)
def test_a_part_of_a_run_is_lossy_for_the_doctor_too(
    kept: list[str], verdict: Verdict, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    part = tmp_path / "part.mcap"
    assert cli.run(["log", "filter", str(LOG), "-o", str(part), *kept]) == 0
    found = examine(part)
    assert found.verdict is verdict
    assert [f for f in found.findings if f.level is Level.ERROR] == []
    capsys.readouterr()
    assert cli.run(["list", str(part), "--json"]) == verdict.exit_code
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert [f.what for f in found.findings if f.level is Level.LOSS] == row["lost"]


def test_what_a_filter_does_not_find_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A camera whose name is misspelt stays in a copy that is given away."""
    to = ["log", "filter", str(LOG), "-o", str(tmp_path / "a.mcap"), "--force"]
    assert cli.run([*to, "-n", "/camra/.*", "-n", "/map", "-y", "/search/.*", "-y", "/serach/.*"]) == 0
    told = capsys.readouterr().err
    assert "note: -n '/camra/.*' leaves nothing out: no topic is called so. There are /log, /map, " in told
    assert "note: -y '/serach/.*' takes nothing in" in told
    assert told.count("note: ") == 2
    assert cli.run([*to, "-y", "/map", "-n", "/map"]) == 2
    assert "no topic that is not excluded" in capsys.readouterr().err
