"""A recorded run is self-describing, repeats byte for byte, and reaches the disk at every decision."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from foxglove_schemas_protobuf.Grid_pb2 import Grid
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.message import Message as ProtobufMessage
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from sample_logs import T0, killed_toy_log, toy_events, toy_info, toy_options, toy_place, toy_task, write_toy_log
from toy import COUNTER, FRIDGE, TABLE, toy_house

from recorders.run_recorder import RunRecorder
from recorders.sinks.files import SplitLimits
from replayers.mcap_io.messages import Message
from replayers.mcap_io.reader import messages
from replayers.runs.run import read
from workbench.errors import OutputExists
from workbench.log_schema.events import NANO, REPEATABLE
from workbench.planning.plans import PlanStatus
from workbench.search.costs import SIMULATION_COSTS


def _by_topic(path: Path) -> dict[str, list[Message]]:
    found: dict[str, list[Message]] = {}
    for message in messages(path):
        found.setdefault(message.topic, []).append(message)
    return found


def test_a_run_comes_back_whole(tmp_path: Path):
    run = read(write_toy_log(tmp_path / "a.mcap"))
    assert run.complete
    assert run.info == toy_info()
    assert run.task == toy_task()
    assert run.costs == SIMULATION_COSTS
    assert run.place.plan == toy_place().plan
    assert [o.container for o in run.observations] == [FRIDGE, TABLE, COUNTER]
    assert [o.known_at_start for o in run.observations] == [True, False, False]
    assert [p.decision for p in run.plans] == [1, 2, 3]
    assert run.plans[0].status == PlanStatus.SOLVED
    assert [a.action for a in run.actions] == ["move", "search", "move", "search", "pick", "move"]
    assert [a.index for a in run.actions] == [1, 2, 3, 4, 5, 6]
    assert run.beliefs[0].probability == ((0.4, 0.6),)
    assert run.outcome is not None
    assert run.outcome.cost == 11.0
    assert run.damage == ()
    assert len(run.sha256) == 64


def test_truth_is_hidden_unless_asked_for(tmp_path: Path):
    path = write_toy_log(tmp_path / "a.mcap")
    assert read(path).truth is None
    truth = read(path, with_truth=True).truth
    assert truth is not None
    assert [i.id for i in truth.contents[COUNTER]] == [i.id for i in toy_house().contents[COUNTER]]


def test_the_same_run_gives_the_same_bytes(tmp_path: Path):
    a, b = (_by_topic(write_toy_log(tmp_path / name)) for name in ("a.mcap", "b.mcap"))
    assert set(a) == set(b)
    for topic in a:
        if topic != "/search/timing":
            assert [(m.log_time, m.data) for m in a[topic]] == [(m.log_time, m.data) for m in b[topic]]
    assert {t for t in a if t.startswith("/search")} >= set(REPEATABLE) - {"/search/truth", "/search/sighting"}


def test_log_times_are_the_events_own_stamps_and_run_forward(tmp_path: Path):
    stamps = [m.log_time for m in messages(write_toy_log(tmp_path / "a.mcap"))]
    assert stamps == sorted(stamps)
    assert stamps[0] == T0
    assert stamps[-1] == T0 + 15 * NANO


def test_every_schema_of_a_domain_topic_describes_its_messages(tmp_path: Path):
    import jsonschema

    for topic, found in _by_topic(write_toy_log(tmp_path / "a.mcap")).items():
        if not topic.startswith("/search"):
            continue
        schema = found[0].schema
        assert schema is not None
        assert schema.encoding == "jsonschema"
        assert schema.name.startswith("lios.")
        described = json.loads(schema.data)
        assert described["type"] == "object"
        for message in found:
            jsonschema.validate(json.loads(message.data), described)


def test_viewer_channels_are_the_published_foxglove_schemas(tmp_path: Path):
    path = write_toy_log(tmp_path / "a.mcap")
    names = {m.topic: m.schema.name for m in messages(path) if m.schema and m.schema.encoding == "protobuf"}
    assert names == {
        "/map": "foxglove.Grid",
        "/viz/scene": "foxglove.SceneUpdate",
        "/tf": "foxglove.FrameTransforms",
        "/robot/pose": "foxglove.PoseInFrame",
        "/robot/path": "foxglove.PosesInFrame",
        "/log": "foxglove.Log",
    }
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        decoded = [m.decoded_message for m in reader.iter_decoded_messages(topics=list(names))]
    assert len(decoded) > 20


def _decoded(path: Path, topic: str, kind: type[ProtobufMessage]) -> list[ProtobufMessage]:
    return [kind.FromString(m.data) for m in messages(path, topics=topic.__eq__)]


def test_every_scene_is_whole_with_stable_ids_and_the_belief_in_the_item_sought(tmp_path: Path):
    scenes = _decoded(write_toy_log(tmp_path / "a.mcap"), "/viz/scene", SceneUpdate)
    ids = [{entity.id for entity in scene.entities} for scene in scenes]  # type: ignore[attr-defined]
    assert all(each == ids[0] for each in ids)
    assert {"room/room|1", "room/room|2", "walls", f"container/{COUNTER}"} <= ids[0]

    def facts(scene: ProtobufMessage, container: str) -> dict[str, str]:
        (entity,) = [e for e in scene.entities if e.id == f"container/{container}"]  # type: ignore[attr-defined]
        return {pair.key: pair.value for pair in entity.metadata}

    at_first_decision = scenes[1]
    assert facts(at_first_decision, TABLE)["probability"] == "0.6000"
    assert facts(at_first_decision, TABLE)["sought"] == "Mug"
    assert facts(at_first_decision, FRIDGE)["searched"] == "yes"
    assert "Tomato" in facts(at_first_decision, FRIDGE)["held"]
    assert facts(scenes[-1], TABLE)["searched"] == "yes"


def test_the_map_has_the_cells_of_the_occupancy_grid(tmp_path: Path):
    (grid,) = _decoded(write_toy_log(tmp_path / "a.mcap"), "/map", Grid)
    occupancy = toy_place().occupancy
    assert occupancy is not None
    assert len(grid.data) == occupancy.occupied.size  # type: ignore[attr-defined]
    assert grid.column_count == occupancy.occupied.shape[1]  # type: ignore[attr-defined]
    assert sum(b > 0 for b in grid.data) == occupancy.occupied.sum()  # type: ignore[attr-defined]


def test_the_robot_walks_along_its_path(tmp_path: Path):
    path = write_toy_log(tmp_path / "a.mcap")
    poses = [p.pose.position.x for p in _decoded(path, "/robot/pose", PoseInFrame)]  # type: ignore[attr-defined]
    assert poses[0] == 1.0
    assert 2.5 in poses
    (first, *_) = _decoded(path, "/robot/path", PosesInFrame)
    assert len(first.poses) >= 2  # type: ignore[attr-defined]


def test_every_decision_is_on_disk_when_record_returns(tmp_path: Path):
    path = tmp_path / "a.mcap"
    recorder = RunRecorder(path, **toy_options())
    seen = 0
    for event in toy_events():
        recorder.record(event)
        if type(event).__name__ == "PlanMade":
            seen += 1
            assert len(read(path).plans) == seen
    recorder.close()
    assert seen == 3


def test_a_killed_recording_reads_up_to_its_last_look(tmp_path: Path):
    run = read(killed_toy_log(tmp_path / "a.mcap"))
    assert not run.complete
    assert run.outcome is None
    assert (len(run.plans), len(run.actions), len(run.observations)) == (1, 2, 2)
    assert run.info == toy_info()
    assert run.damage[0].cut_off


def test_an_exception_in_the_run_leaves_a_closed_log(tmp_path: Path):
    path = tmp_path / "a.mcap"

    def stop() -> None:
        with RunRecorder(path, **toy_options()) as recorder:
            recorder.record(toy_events()[0])
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stop()
    run = read(path)
    assert len(run.observations) == 1
    assert not run.complete
    assert run.damage == ()


def test_an_existing_log_is_not_touched(tmp_path: Path):
    path = write_toy_log(tmp_path / "a.mcap")
    before = path.read_bytes()
    with pytest.raises(OutputExists):
        write_toy_log(path)
    assert path.read_bytes() == before


def test_strange_names_survive(tmp_path: Path):
    info = toy_info(place="naïve 家 \"quoted\" [x] 'y' <b>", title="a\nb")
    options = toy_options() | {"info": info}
    with RunRecorder(tmp_path / "a b [c] 家.mcap", **options):
        pass
    assert read(tmp_path / "a b [c] 家.mcap").info == info


def test_recording_in_the_background_writes_the_same(tmp_path: Path):
    write_toy_log(tmp_path / "a.mcap")
    with RunRecorder(tmp_path / "b.mcap", background=True, **toy_options()) as recorder:
        for event in toy_events():
            recorder.record(event)
    a, b = _by_topic(tmp_path / "a.mcap"), _by_topic(tmp_path / "b.mcap")
    assert {t: [m.data for m in a[t]] for t in a} == {t: [m.data for m in b[t]] for t in b}
    assert read(tmp_path / "b.mcap").complete


def test_every_part_of_a_split_run_opens_alone(tmp_path: Path):
    with RunRecorder(tmp_path / "a.mcap", split=SplitLimits(part_s=4.0), **toy_options()) as recorder:
        for event in toy_events():
            recorder.record(event)
    parts = sorted(tmp_path.glob("*.mcap"))
    assert [p.name for p in parts] == ["a_0000.mcap", "a_0001.mcap", "a_0002.mcap", "a_0003.mcap"]
    for part in parts:
        run = read(part, with_truth=True)
        assert run.info == toy_info()
        assert run.place.plan == toy_place().plan
        assert run.truth is not None
        assert {"/map", "/viz/scene"} <= set(_by_topic(part))
    actions = [a.index for part in parts for a in read(part).actions]
    assert actions == [1, 2, 3, 4, 5, 6]
