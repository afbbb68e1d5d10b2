"""Recordings for Rerun: what Rerun's own reader finds in them is what the run holds."""

from __future__ import annotations

import sys
from collections import defaultdict
from dataclasses import dataclass, field, replace
from pathlib import Path
from shutil import copy
from typing import Any

import numpy as np
import pytest
from toy import FRIDGE
from toy_run import empty_run, ns, toy_run

from dashboards.model.containers.container_style import container_colours
from dashboards.model.scene import scene_at
from dashboards.model.timeline import NEVER, Timeline, timeline_of
from replayers.log_tools.notes import add_note, notes_of
from replayers.runs.run import read
from workbench import cli

pytest.importorskip("rerun", reason="rerun-sdk is not installed")

from rerun.chunk import RrdReader

from dashboards.rerun_export.containers import moments
from dashboards.rerun_export.robot import path_pieces
from dashboards.rerun_export.series import series_of
from dashboards.rerun_export.write import write_rrd

LOGS = Path(__file__).resolve().parents[2] / "logs"


@dataclass
class Entity:
    """What a recording holds of one entity: rows by component as (stamp, value), and static components."""

    rows: dict[str, list[tuple[int, Any]]] = field(default_factory=lambda: defaultdict(list))
    static: dict[str, Any] = field(default_factory=dict)


def loaded(path: Path) -> dict[str, Entity]:
    """The recording as Rerun's reader gives it, by entity path without the leading slash."""
    found: dict[str, Entity] = defaultdict(Entity)
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        entity = found[chunk.entity_path.removeprefix("/")]
        for name in batch.schema.names:
            if ":" not in name:
                continue
            values = batch.column(name).to_pylist()
            if chunk.is_static:
                entity.static[name] = values[0]
            else:
                stamps = batch.column("time").cast("int64").to_pylist()
                since = batch.column("run_time").cast("int64").to_pylist()
                assert len({a - b for a, b in zip(stamps, since, strict=True)}) == 1, "two timelines, one run"
                entity.rows[name] += zip(stamps, values, strict=True)
    for entity in found.values():
        for rows in entity.rows.values():
            rows.sort(key=lambda row: row[0])
    return found


def exported(timeline: Timeline, tmp_path: Path) -> dict[str, Entity]:
    write_rrd(timeline, (), tmp_path / "run.rrd")
    return loaded(tmp_path / "run.rrd")


@pytest.fixture(params=["find-lios", "spot-home-A", "cut-off"])
def timeline(request: pytest.FixtureRequest) -> Timeline:
    return timeline_of(read(LOGS / f"{request.param}.mcap"))


def scalars(entity: Entity) -> list[tuple[int, float]]:
    return [(stamp, value[0]) for stamp, value in entity.rows["Scalars:scalars"]]


@pytest.mark.ci_but(1)
def test_the_beliefs_of_the_run_come_back(timeline: Timeline, tmp_path: Path):
    found = exported(timeline, tmp_path)
    for belief in timeline.run.beliefs:
        for item_type, row in zip(belief.item_types, belief.probability, strict=True):
            for container, p in zip(belief.containers, row, strict=True):
                path = f"belief/{item_type}/{container}".replace("|", "\\|")
                assert (belief.stamp.ns, p) in scalars(found[path])
    assert sum(len(scalars(entity)) for path, entity in found.items() if path.startswith("belief/")) == sum(
        len(b.item_types) * len(b.containers) for b in timeline.run.beliefs
    )


@pytest.mark.ci_but(1)
def test_all_series_come_back_and_the_cost_ends_at_the_runs_own(timeline: Timeline, tmp_path: Path):
    found = exported(timeline, tmp_path)
    series = series_of(timeline)
    assert {path for path in found if path.startswith(("cost/", "find_costs/", "belief/"))} == series.keys()
    for path, points in series.items():
        assert sorted(scalars(found[path])) == sorted(points)
    assert max(value for _, value in scalars(found["cost/so_far"])) == pytest.approx(timeline.cost[-1])
    plans = [p for p in timeline.run.plans if p.expected_cost is not None]
    assert [value for _, value in scalars(found["cost/plan"])] == [p.expected_cost for p in plans]


@pytest.mark.ci_but(1)
def test_containers_are_boxes_in_the_colours_of_the_dashboard(timeline: Timeline, tmp_path: Path):
    found = exported(timeline, tmp_path)
    for i, container in enumerate(timeline.plan.containers):
        entity = found[f"containers/{container.id}".replace("|", "\\|")]
        middle_m = container.base_m + container.size_m[2] / 2
        assert entity.static["Boxes3D:centers"][0] == pytest.approx(
            [container.pose.x_m, container.pose.y_m, middle_m]
        )
        assert entity.static["Boxes3D:half_sizes"][0] == pytest.approx(np.array(container.size_m) / 2)
        assert [stamp for stamp, _ in entity.rows["Boxes3D:colors"]] == moments(timeline)
        for stamp, (rgba,) in entity.rows["Boxes3D:colors"]:
            wanted = container_colours(scene_at(timeline, stamp))[i]
            assert list(rgba.to_bytes(4, "big")) == [*wanted.tolist(), 255]
        searched = int(timeline.searched_ns[i])
        for stamp, (label,) in entity.rows["Boxes3D:labels"]:
            assert label.endswith(": searched") == (searched != NEVER and searched <= stamp)


@pytest.mark.ci_but(1)
def test_the_way_comes_back_whole(timeline: Timeline, tmp_path: Path):
    found = exported(timeline, tmp_path)
    strips = [
        np.array(entity.rows["LineStrips3D:strips"][0][1][0])[:, :2]
        for path, entity in sorted(found.items())
        if path.startswith("way/")
    ]
    assert len(strips) == len(path_pieces(timeline)) > 1
    walked_m = sum(float(np.hypot(*np.diff(strip, axis=0).T).sum()) for strip in strips)
    assert walked_m == pytest.approx(timeline.path_m[-1], rel=1e-4)
    for stamp, (position,) in found["robot"].rows["Transform3D:translation"]:
        robot = scene_at(timeline, stamp).robot
        assert position[:2] == pytest.approx([robot.x_m, robot.y_m], abs=0.02)


def test_the_toy_run_by_hand(tmp_path: Path):
    """The fridge is reached at 2 s after 1 m, the counter at 5 s after 1.5 m more; the mug is seen at 7 s."""
    found = exported(timeline_of(toy_run()), tmp_path)
    first, second = found["way/0001"], found["way/0002"]
    assert first.rows["LineStrips3D:strips"][0][0] == ns(2)
    assert [p[:2] for p in first.rows["LineStrips3D:strips"][0][1][0]] == [[1.0, 2.0], [1.0, 3.0]]
    assert [p[:2] for p in second.rows["LineStrips3D:strips"][0][1][0]] == [[1.0, 3.0], [2.5, 3.0]]
    seen = [row for path, e in found.items() if path.startswith("items/") for row in e.rows["Points3D:labels"]]
    assert (ns(7), ["mug"]) in [(stamp, [label for label in labels if label == "mug"]) for stamp, labels in seen]
    assert found["house/rooms"].static["Points3D:labels"]
    assert found["log/looks"].rows["TextLog:text"]
    assert found["log/outcome"].rows["TextLog:text"]


def test_a_run_without_events_is_its_house(tmp_path: Path):
    found = exported(timeline_of(empty_run()), tmp_path)
    assert found["house/walls/box"].static
    assert not [path for path in found if path.startswith("belief/")]


def test_names_of_any_kind_are_one_part_of_a_path(tmp_path: Path):
    run = toy_run()
    place = run.place
    odd = "a/b c\n#é"
    plan = replace(
        place.plan,
        containers=tuple(replace(c, id=odd) if c.id == FRIDGE else c for c in place.plan.containers),
    )
    found = exported(timeline_of(replace(run, place=replace(place, plan=plan))), tmp_path)
    assert len([path for path in found if path.startswith("containers/")]) == len(plan.containers)
    assert "containers/a\\/b\\ c\\n\\#é" in found


def test_the_command_takes_notes_along(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    log = Path(copy(LOGS / "find-lios.mcap", tmp_path / "one.mcap"))
    note = add_note(log, "the drawer was stuck", at="3", author="Ada")
    assert cli.run(["export", str(log), "-o", str(tmp_path / "one.rrd")]) == 0
    assert notes_of(log)[0].text == "the drawer was stuck"
    rows = loaded(tmp_path / "one.rrd")["log/notes"].rows["TextLog:text"]
    assert rows == [(note.start_ns, ["Ada: the drawer was stuck"])]
    assert "one.rrd" in capsys.readouterr().err
    store = RrdReader(tmp_path / "one.rrd").recordings()[0]
    assert (store.application_id, store.recording_id) == ("lios", read(log).info.run_id)
    assert RrdReader(tmp_path / "one.rrd").blueprints()


def test_several_logs_make_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    logs = [str(LOGS / "find-lios.mcap"), str(LOGS / "spot-home-A.mcap")]
    assert cli.run(["export", *logs, "--format", "rrd", "-o", str(tmp_path / "out")]) == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["find-lios.rrd", "spot-home-A.rrd"]
    assert cli.run(["export", *logs, "--format", "rrd", "-o", str(tmp_path / "out")]) == 2
    assert "--force" in capsys.readouterr().err
    assert cli.run(["export", *logs, "-o", str(tmp_path / "both.rrd")]) == 2
    assert "a folder" in capsys.readouterr().err


def test_a_log_that_cannot_be_read_is_left_out_of_several(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(b"no log")
    logs = [str(broken), str(LOGS / "find-lios.mcap")]
    assert cli.run(["export", *logs, "--format", "rrd", "-o", str(tmp_path / "out")]) == 3
    assert "left out" in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["find-lios.rrd"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["-o", "x.rrd", "-t", "runs"], "--table"),
        (["-o", "x.rrd", "--partition-by", "place"], "--partition-by"),
        (["-o", "x.rrd", "--format", "csv"], "--format"),
        (["-o", "x", "--format", "rdd"], "--format"),
    ],
)
def test_options_that_do_not_fit_are_one_line(
    options: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
):
    monkeypatch.chdir(tmp_path)
    assert cli.run(["export", str(LOGS / "find-lios.mcap"), *options]) == 2
    assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_two_logs_of_one_name_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        copy(LOGS / "find-lios.mcap", tmp_path / folder / "run.mcap")
    out = tmp_path / "out"
    assert cli.run(["export", str(tmp_path / "a"), str(tmp_path / "b"), "--format", "rrd", "-o", str(out)]) == 2
    assert "run.mcap" in capsys.readouterr().err
    assert not out.exists()


def test_without_the_extra_one_line_says_which(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    for name in [name for name in sys.modules if name.startswith("dashboards.rerun_export")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert cli.run(["export", str(LOGS / "find-lios.mcap"), "-o", str(tmp_path / "x.rrd")]) == 2
    assert "lios-workbench[rerun]" in capsys.readouterr().err
