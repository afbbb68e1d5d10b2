"""Plans that were not found have no expected cost, in the log, in tables and on screen.

Also for logs of schema version 1, which hold 0.0.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from msgspec import structs
from sample_logs import T0, record_run, toy_events, toy_info, toy_options

from dashboards.capsule.write import capsule_page
from dashboards.figures.cost_over_time import draw_cost_over_time
from dashboards.model.scene import scene_at
from dashboards.model.timeline import timeline_of
from dashboards.panels.now import now
from dashboards.panels.plan import plan
from recorders.spot.run.event_text import event_line
from replayers.runs.run import read
from workbench.cli import run as lios
from workbench.execution.events import Event, PlanMade, RunEnded, RunStatus
from workbench.log_schema.events import NANO, SCHEMA_VERSION
from workbench.log_schema.run_info import INFO_METADATA, info_to_metadata
from workbench.planning.plans import Plan, PlanStatus
from workbench.planning.strategy import Decision


def events_without_a_last_plan() -> list[Event]:
    """The toy run, until after the first look nothing more can be planned."""
    events = toy_events()
    second = next(i for i, e in enumerate(events) if isinstance(e, PlanMade) and e.decision == 2)
    planned = events[second]
    assert isinstance(planned, PlanMade)
    none = Decision(plan=Plan(status=PlanStatus.NO_PLAN, note="every container is searched", solver="built-in"))
    ended = RunEnded(
        stamp_ns=T0 + 3 * NANO,
        decision=2,
        status=RunStatus.NO_PLAN,
        cost=400.0,
        own_cost=1.0,
        reason="every container is searched",
        searches=1,
        travel_m=1.0,
    )
    return [*events[:second], replace(planned, made=none), ended]


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "now.mcap"
    options = toy_options() | {"info": toy_info(strategy="made-by-hand")}
    record_run(path, iter(events_without_a_last_plan()), **options)  # type: ignore[arg-type]
    return path


@pytest.fixture
def old_log(log: Path) -> Path:
    """The same as version 1 wrote it."""
    info, path = read(log).info, log.with_name("old.mcap")
    with log.open("rb") as stream, path.open("wb") as out:
        reader, writer = make_reader(stream), Writer(out)
        writer.start(library="lios-workbench/0.1.0")
        for found in reader.iter_attachments():
            writer.add_attachment(found.create_time, found.log_time, found.name, found.media_type, found.data)
        for record in reader.iter_metadata():
            ours = record.name == INFO_METADATA
            pairs = info_to_metadata(structs.replace(info, schema_version=1)) if ours else record.metadata
            writer.add_metadata(record.name, pairs)
        channels: dict[str, int] = {}
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            if channel.topic not in channels:
                kind = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, channel.message_encoding, kind)
            data = message.data
            if channel.topic == "/search/plan":
                data = json.dumps({"expected_cost": 0.0} | json.loads(data)).encode()
            writer.add_message(channels[channel.topic], message.log_time, data, message.publish_time)
        writer.finish()
    return path


def test_the_log_holds_no_number(log: Path, old_log: Path) -> None:
    def expected(path: Path) -> list[object]:
        with path.open("rb") as stream:
            return [
                json.loads(m.data).get("expected_cost")
                for _, _, m in make_reader(stream).iter_messages("/search/plan")
            ]

    assert expected(log) == [9.25, None]
    assert expected(old_log) == [9.25, 0.0]
    assert (read(log).info.schema_version, read(old_log).info.schema_version) == (SCHEMA_VERSION, 1)


def test_nor_do_the_words_for_people(log: Path) -> None:
    with log.open("rb") as stream:
        said = [m.data for _, _, m in make_reader(stream).iter_messages("/log")]
    assert any(b"every container is searched; no-plan" in words for words in said)
    assert not any(b"expected 0.0" in words for words in said)
    planned = [e for e in events_without_a_last_plan() if isinstance(e, PlanMade)][-1]
    assert event_line(planned) == "Plan 2 (searched DiningTable|1), no-plan: every container is searched"


def test_an_old_log_reads_as_a_new_one(log: Path, old_log: Path) -> None:
    assert read(old_log).plans == read(log).plans
    assert [p.expected_cost for p in read(old_log).plans] == [9.25, None]


@pytest.mark.parametrize("version", ["log", "old_log"])
def test_tables_exports_and_checks_do_without(
    version: str, request: pytest.FixtureRequest, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path: Path = request.getfixturevalue(version)
    decisions = read(path).tables.decisions
    assert decisions["expected_cost"].isna().tolist() == [False, True]
    assert lios(["export", str(path), "-o", str(tmp_path / "csv"), "--format", "csv"]) == 0
    (table,) = (tmp_path / "csv").rglob("decisions*.csv")
    assert pd.read_csv(table)["expected_cost"].isna().tolist() == [False, True]
    assert lios(["doctor", str(path)]) == 0
    capsys.readouterr()
    assert lios(["replay", str(path), "-s", "opt-greedy", "--worlds", "10"]) == 0
    assert "nan" not in capsys.readouterr().out


def test_a_replay_of_an_old_log_is_of_the_version_that_writes_it(old_log: Path, tmp_path: Path) -> None:
    assert lios(["replay", str(old_log), "-s", "opt-greedy", "--worlds", "0", "-o", str(tmp_path / "kept")]) == 0
    (replayed,) = (tmp_path / "kept").rglob("*.mcap")
    assert read(replayed).info.schema_version == SCHEMA_VERSION


@pytest.mark.parametrize("version", ["log", "old_log"])
def test_the_dashboard_shows_a_dash(version: str, request: pytest.FixtureRequest) -> None:
    timeline = timeline_of(read(request.getfixturevalue(version)))
    scene = scene_at(timeline, timeline.end_ns)
    assert scene.expected_cost is None
    assert "<b>–</b><span>plan expected</span>" in now(scene)
    assert "No plan in force (no-plan)" in plan(scene)
    assert capsule_page([timeline])
    figure, ax = plt.subplots()
    draw_cost_over_time(ax, [timeline])
    (step,) = [line for line in ax.get_lines() if str(line.get_label()).startswith("expected in all")]
    assert set(step.get_ydata()) == {9.25}
    plt.close(figure)
