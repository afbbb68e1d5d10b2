"""Tags by the robot's detector and by ours: where they are placed, and what the log says of each detection."""

from __future__ import annotations

import json
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from bosdyn.api.graph_nav import nav_pb2
from mcap.reader import make_reader
from spot_help import FEW, messages, placed, robot

from recorders.sinks.files import LogFiles
from recorders.spot.client.connection import Connection
from recorders.spot.client.control import Control
from recorders.spot.client.time_source import RunningClock
from recorders.spot.run.run_settings import RunSettings
from recorders.spot.run.world import SpotWorld
from recorders.spot.session.session import Session
from recorders.spot.simulated.services.server import SimulatedSpot
from replayers.runs.run import read
from workbench.cli import run as lios
from workbench.worlds.house import ContainerId, LocationId
from workbench.worlds.sites.configurations import pick_configuration, site_and_house
from workbench.worlds.sites.site import Site, load_site
from workbench.worlds.sites.survey_schema import ROBOT_TAG_M
from workbench.worlds.world import LookResult

PHONE, TABLE = 102, ContainerId("dining_table")


def site_with(folder: Path, *, size_m: float, detector: str = "") -> Site:
    """The paper's home with small tags and a choice of detector, configuration A."""
    home = load_site("paper_home")
    shutil.copytree(home.path.parent, folder, dirs_exist_ok=True)
    path = folder / "site.yaml"
    text = path.read_text().replace("type: CellPhone}", f"type: CellPhone, size_m: {size_m}}}")
    if detector:  # from where one stands by itself, the bottle's tag is above what the cameras see
        counter = "waypoint: wp-countertop"
        text = text.replace(counter, f"{counter}\n    stand: {{x_m: 2.3, y_m: 3.55, yaw_deg: 90}}")
    path.write_text(text + detector)
    site = load_site(path)
    return site_and_house(site, pick_configuration(site, "A"))[0]


OURS = "\ndetector: {kind: opencv, cameras: [frontleft_fisheye_image, hand_color_image]}\n"


def stand_at(spot: SimulatedSpot, connection: Connection, container: ContainerId) -> tuple[float, float, float]:
    """The robot stands at a container, localised; where the phone is."""
    pose = spot.state.site.paths.standing_pose(LocationId(container))
    assert pose is not None
    spot.state.body.pose, spot.state.body.standing = pose, True
    connection.client("graph-nav-service").set_localization(nav_pb2.Localization(), fiducial_init=2)
    return next(thing.position for thing in spot.state.things if thing.tag == PHONE)


def detections(spot: SimulatedSpot, connection: Connection, log: Path) -> list[dict[str, Any]]:
    files = LogFiles(log, force=True)
    session = Session(connection, spot.state.site, files, rates=replace(FEW, fiducials_hz=2.0, images_hz=0.0))
    for _ in range(4):
        session.tick()
        connection.clock.sleep(0.5)
    files.close()
    return [json.loads(data) for *_, data in messages(log, "/robot/detections")]


@pytest.mark.parametrize("size_m", [0.1, ROBOT_TAG_M])
def test_a_tag_of_another_size_is_placed_by_its_own(size_m: float, tmp_path: Path) -> None:
    site = site_with(tmp_path, size_m=size_m)
    with robot(site=site) as (spot, connection):
        at = stand_at(spot, connection, TABLE)
        seen = [told for told in detections(spot, connection, tmp_path / "s.mcap") if told["tag"] == PHONE]
    assert len(seen) == 4, "each detection once"
    assert [seen[0][axis] for axis in ("x_m", "y_m", "z_m")] == pytest.approx(at, abs=0.03)
    raw = seen[0]["raw"]
    told_m = float(np.hypot(np.hypot(raw["x"], raw["y"]), raw["z"]))
    assert told_m == pytest.approx(seen[0]["range_m"] * ROBOT_TAG_M / size_m, rel=1e-6)
    assert (seen[0]["detector"], seen[0]["item"], seen[0]["container"]) == ("robot", "CellPhone|1", TABLE)
    assert seen[0]["camera"] == raw["frame"]
    assert seen[0]["status"] == "ok"
    assert 0 <= seen[0]["incidence_deg"] < 60
    assert 0 <= seen[0]["age_s"] < 1
    assert seen[0]["counts"]


def test_a_look_by_our_detector_finds_what_the_robots_own_is_not_asked_for(tmp_path: Path) -> None:
    pytest.importorskip("cv2", reason="the extra opencv is not installed")
    site = site_with(tmp_path, size_m=0.08, detector=OURS)
    with robot(site=site) as (spot, connection), Control(connection, own_estop=True) as control:
        at = stand_at(spot, connection, TABLE)
        settings = RunSettings(poll_s=0.5, look_s=1.5)
        world = SpotWorld(connection=connection, control=control, site=site, settings=settings)
        world.at = LocationId(TABLE)
        looked = world.look_into(TABLE)
        told = detections(spot, connection, tmp_path / "s.mcap")
        spot.state.hides_tags = True
        empty = world.look_into(TABLE)
    assert isinstance(looked, LookResult)
    assert [item.id for item in looked.items] == ["CellPhone|1"]
    assert isinstance(empty, LookResult)
    assert empty.items == ()
    polls = [json.loads(data) for *_, data in messages(tmp_path / "s.mcap", "/robot/tag_polls")]
    assert {(poll["detector"], poll["counts"]) for poll in polls} == {("robot", False), ("opencv", True)}
    phone = [seen for seen in told if seen["tag"] == PHONE]
    assert {(seen["detector"], seen["counts"]) for seen in phone} == {("robot", False), ("opencv", True)}
    ours = next(seen for seen in phone if seen["detector"] == "opencv")
    assert [ours[axis] for axis in ("x_m", "y_m", "z_m")] == pytest.approx(at, abs=0.03)
    assert ours["size_m"] == 0.08
    assert 0 <= ours["error_px"] < 1
    assert ours["camera"] in ("frontleft_fisheye", "hand_color")


def test_it_is_logged_when_a_detector_was_asked_also_where_it_saw_nothing(tmp_path: Path) -> None:
    log = tmp_path / "s.mcap"
    with robot() as (spot, connection):
        stand_at(spot, connection, TABLE)
        files = LogFiles(log, force=True)
        session = Session(connection, spot.state.site, files, rates=replace(FEW, fiducials_hz=20.0, images_hz=0.0))
        for step in range(40):
            spot.state.hides_tags = step >= 20
            spot.state.sightings.clear()
            session.tick()
            connection.clock.sleep(0.05)
        files.close()
        assert spot.state.things
    told = messages(log, "/robot/tag_polls")
    polls = [json.loads(data) for *_, data in told]
    assert 6 <= len(polls) <= 9, "of 40 in 2 s, four a second"
    assert [PHONE in poll["tags"] for poll in polls] == sorted(
        (PHONE in poll["tags"] for poll in polls), reverse=True
    )
    assert polls[-1]["tags"] == []
    assert {(poll["detector"], poll["counts"], poll["localized"]) for poll in polls} == {("robot", True, True)}
    with log.open("rb") as stream:
        schemas = {s.name: s.data for s, _, _ in make_reader(stream).iter_messages() if s is not None}
    jsonschema.validate(polls[-1], json.loads(schemas["lios.spot.TagPoll"]))


def test_a_tag_of_the_map_is_logged_in_passing_with_its_place(tmp_path: Path) -> None:
    with robot() as (spot, connection):
        connection.client("graph-nav-service").set_localization(nav_pb2.Localization(), fiducial_init=2)
        hung = spot.state.fiducials[540]
        (seen, *_) = [told for told in detections(spot, connection, tmp_path / "s.mcap") if told["tag"] == 540]
    assert [seen[axis] for axis in ("x_m", "y_m", "z_m")] == pytest.approx(hung, abs=0.03)
    assert (seen["item"], seen["container"]) == ("", "")


def test_what_is_seen_before_the_robot_knows_where_it_is_is_logged_without_a_place(tmp_path: Path) -> None:
    log = tmp_path / "s.mcap"
    with robot() as (spot, connection):
        (seen, *_) = detections(spot, connection, log)
    assert "x_m" not in seen
    assert seen["range_m"] > 0
    with log.open("rb") as stream:
        reader = make_reader(stream)
        schemas = {schema.name: schema.data for schema, _, _ in reader.iter_messages() if schema is not None}
    jsonschema.validate(seen, json.loads(schemas["lios.spot.TagDetected"]))


def test_a_session_is_recorded_with_the_detector_that_its_site_chooses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("cv2", reason="the extra opencv is not installed")
    site = site_with(tmp_path / "home", size_m=0.08, detector=OURS)
    house = placed()[1]
    monkeypatch.setenv("BOSDYN_CLIENT_USERNAME", "user")
    monkeypatch.setenv("BOSDYN_CLIENT_PASSWORD", "simulated")
    log = tmp_path / "s.mcap"
    with SimulatedSpot(site, replace(house, plan=site.plan), clock=RunningClock()) as spot:
        there = spot.options(spot.write_certificate(tmp_path / "robot.pem"), tmp_path / "home")
        pose = site.paths.standing_pose(LocationId(TABLE))
        assert pose is not None
        spot.state.body.pose, spot.state.body.standing, spot.state.localized = pose, True, True
        assert lios(["spot", "record", *there, "-o", str(log), "--for", "1.5", "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["taken"]["tag pictures"] >= 1
        monkeypatch.setitem(sys.modules, "cv2", None)
        for command in ("record", "run"):
            assert lios(["spot", command, *there, "-o", str(tmp_path / "no.mcap")]) == 2
            assert "lios-workbench[opencv]" in capsys.readouterr().err
        assert not (tmp_path / "no.mcap").exists()
    told = [json.loads(data) for *_, data in messages(log, "/robot/detections")]
    assert {seen["detector"] for seen in told if seen["tag"] == PHONE} == {"robot", "opencv"}


@pytest.mark.slow
def test_sessions_and_runs_find_items_in_their_containers_by_our_detector_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """By the command line, from drawn pictures of hand and body cameras to the looks of the log and its replay."""
    pytest.importorskip("cv2", reason="the extra opencv is not installed")
    site = site_with(tmp_path / "home", size_m=0.08, detector=OURS)
    house = replace(placed()[1], plan=site.plan)
    monkeypatch.setenv("BOSDYN_CLIENT_USERNAME", "user")
    monkeypatch.setenv("BOSDYN_CLIENT_PASSWORD", "simulated")
    session, run = tmp_path / "session.mcap", tmp_path / "run.mcap"
    for log, speed_up in ((session, 1.0), (run, 10.0)):
        with SimulatedSpot(site, house, clock=RunningClock(speed_up=speed_up)) as spot:
            there = spot.options(spot.write_certificate(tmp_path / "robot.pem"), tmp_path / "home")
            there += ["-o", str(log), "--images-hz", "0"]
            if log == session:
                pose = site.paths.standing_pose(LocationId(TABLE))
                assert pose is not None
                spot.state.body.pose, spot.state.body.standing, spot.state.localized = pose, True, True
                assert lios(["spot", "record", *there, "--for", "8"]) == 0
            else:
                how = ["--own-estop", "--furniture-open", "--look", "2", "-s", "pes-greedy", "--estimator", "counts"]
                assert lios(["spot", "run", *there, *how, "--stop-within", "2"]) == 0
    (look,) = read(session).observations
    assert (look.container, [item.id for item in look.items]) == (TABLE, ["CellPhone|1"])
    recorded = read(run)
    assert recorded.outcome is not None
    assert recorded.outcome.status == "done", recorded.outcome.reason
    for seen in recorded.observations:
        there_at_start = {item.id for item in house.contents[ContainerId(seen.container)]}
        assert {item.id for item in seen.items} == there_at_start & {item.id for item in site.tags.values()}
    told = [json.loads(data) for *_, data in messages(run, "/robot/detections")]
    items = [seen for seen in told if seen["item"]]
    assert {seen["detector"] for seen in items if seen["counts"]} == {"opencv"}
    assert {seen["camera"] for seen in items if seen["counts"]} == {"frontleft_fisheye", "hand_color"}
    capsys.readouterr()
    assert lios(["replay", str(run), "-s", "pes-greedy", "--worlds", "0", "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert row["exact"]
