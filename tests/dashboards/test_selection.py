"""The panel of a folder of trials: what its kept replays say, in words that no log can make markup of."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from shutil import copy
from typing import Any

import msgspec
import pytest

import replayers
from dashboards.library.run_table import log_rows
from dashboards.model.selection import selection_in
from dashboards.panels.folder.selection import selection
from replayers.batch.store import SUFFIX, read_replay, write_replay
from replayers.counterfactual.prepared_log import ReplaySettings
from workbench.cli import run as lios

LOGS = Path(__file__).resolve().parents[2] / "logs"


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of two finds with the replays of two strategies."""
    folder = tmp_path_factory.mktemp("trials")
    for name in ("find-greedy", "find-lios"):
        copy(LOGS / f"{name}.mcap", folder)
    settings = ReplaySettings(worlds=5)
    replayers.replay(folder, "pes-greedy,pes-lios", settings=settings, output=folder / "replays")
    return folder


def test_it_says_what_to_drive_next_and_after_which_trial_that_was_known(kept: Path) -> None:
    found = selection_in(kept)
    ((group, verdicts),) = found.groups
    assert [v.trials for v in verdicts] == [1, 2]
    assert all(log.exists() for log in group.logs)
    shown = str(selection(found, kept))
    assert f"Drive {verdicts[-1].next} next." in shown
    assert "find-greedy.mcap" in shown.replace("<wbr>", "")
    assert shown.count("<table") == 2


def test_recorded_replays_and_logs_elsewhere_count_for_nothing(kept: Path, tmp_path: Path) -> None:
    for file in kept.rglob(f"*{SUFFIX}"):
        write_replay(tmp_path / file.name, msgspec.structs.replace(read_replay(file), log="elsewhere.mcap"))
    assert selection_in(tmp_path).groups == ()


def test_replays_kept_apart_from_their_logs_are_shown_too(kept: Path, tmp_path: Path) -> None:
    """As `lios select LOGS -o FOLDER` leaves them; a log that was changed since is told, and counts for nothing."""
    logs, apart = tmp_path / "logs", tmp_path / "apart"
    logs.mkdir()
    for log in kept.glob("*.mcap"):
        copy(log, logs)
    for file in kept.rglob(f"*{SUFFIX}"):
        record = read_replay(file)
        write_replay(
            apart / file.parent.name / file.name,
            msgspec.structs.replace(record, log=str(logs / Path(record.log).name)),
        )
    ((group, verdicts),) = selection_in(apart).groups
    assert [v.trials for v in verdicts] == [1, 2]
    assert {log.parent for log in group.logs} == {logs}
    with (logs / "find-lios.mcap").open("ab") as changed:
        changed.write(b"more")
    found = selection_in(apart)
    assert [v.trials for v in found.groups[0][1]] == [1]
    assert len(found.left_out) == 1
    assert "find-lios.mcap" in found.left_out[0]


def selected(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    """The groups of `lios select --json`."""
    assert lios(["select", *arguments, "--worlds", "2", "--json"]) in (0, 3)
    return json.loads(capsys.readouterr().out)["groups"]


def test_the_panel_shows_the_candidates_of_the_command_and_whose_beliefs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Several estimators are several candidates; a later answer into the same folder takes the place of this one."""
    log, kept = str(LOGS / "find-greedy.mcap"), tmp_path / "kept"
    wish = [log, "-s", "greedy,lios", "-o", str(kept)]
    (told,) = selected(capsys, *wish, "--estimator", "counts,people", "--alpha", "0.2")
    found = selection_in(tmp_path)
    ((_, verdicts),) = found.groups
    assert (found.alpha, found.estimators, len(verdicts[-1].standings)) == (0.2, ("counts", "people"), 4)
    rows = [(s.strategy, s.lower, s.expected, s.to_come, s.chance_best) for s in verdicts[-1].standings]
    assert rows == [
        (r["strategy"], r["lower"], r["expected"], r["to_come"], r["chance_best"]) for r in told["after"][-1]["rows"]
    ]
    shown = str(selection(found, tmp_path))
    assert "counts, people answered last here" in shown.replace("<code>", "").replace("</code>", "")
    (told,) = selected(capsys, *wish, "--estimator", "people")
    again = selection_in(tmp_path)
    assert again.estimators == ("people",)
    assert again.groups[0][1][-1].next == told["next"]
    assert len(again.groups[0][1][-1].standings) == 2


def test_what_the_command_leaves_out_the_panel_leaves_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "half.py").write_text("x = 1\n")
    log = str(LOGS / "find-greedy.mcap")
    selected(capsys, log, "-s", "greedy,lios,half:Nope", "-o", "kept", "--group-by", "site")
    found = selection_in(tmp_path / "kept")
    assert list(found.not_replayed) == ["half:Nope"]
    assert found.groups[0][0].name.startswith("find, in simulation, in ")  # the place, by --group-by
    assert "left out of the choice: half:Nope: it raised" in str(selection(found, tmp_path))
    replayers.replay(log, "greedy", settings=ReplaySettings(worlds=3), output="kept")
    assert any("1 of the 2 replays of this answer were removed, or made again" in line
               for line in selection_in(tmp_path / "kept").left_out)  # fmt: skip
    (tmp_path / "kept" / "junk").mkdir()
    (tmp_path / "kept" / "junk" / "selection.json").write_text("{}")
    about = [line for line in selection_in(tmp_path / "kept").left_out if "junk" in line]
    assert len(about) == 1, "no answer, and so no earlier one"


def test_the_table_of_runs_names_the_log_of_each_replay(kept: Path) -> None:
    rows, _ = log_rows(sorted(kept.rglob("*.mcap")), folder=kept)
    assert sorted(row.replay_of for row in rows if row.source == "replay") == 2 * ["find-greedy.mcap"] + 2 * [
        "find-lios.mcap"
    ]
    assert {row.replay_of for row in rows if row.source != "replay"} == {""}


def test_a_folder_without_replays_says_how_to_make_them(tmp_path: Path) -> None:
    shown = str(selection(selection_in(tmp_path), tmp_path / "<b>trials"))
    assert "lios select &lt;b&gt;trials -o &lt;b&gt;trials/replays" in shown


def test_a_file_that_is_no_replay_is_told(kept: Path, tmp_path: Path) -> None:
    (tmp_path / f"x{SUFFIX}").write_text("<script>")
    found = selection_in(tmp_path)
    assert len(found.left_out) == 1
    assert "left out: " in str(selection(found, tmp_path))


def test_names_of_logs_are_text(kept: Path) -> None:
    found = selection_in(kept)
    ((group, verdicts),) = found.groups
    named = replace(found, groups=((replace(group, name="<script>alert(1)</script>"), verdicts),))
    assert "<script>" not in str(selection(named, kept))
