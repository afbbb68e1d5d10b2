"""Survey files: the shipped home, ROS maps, measured travel costs, and mistakes that are reported."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import hypot
from pathlib import Path

import numpy as np
import pytest

from workbench.commands.site import check
from workbench.errors import BadValue, Failed, FileMissing, MalformedFile, UnknownName
from workbench.worlds.house import START, LocationId
from workbench.worlds.maps.occupancy import OccupancyGrid, occupancy_of
from workbench.worlds.sites.check import check_site
from workbench.worlds.sites.configurations import (
    configurations_of,
    load_configurations,
    pick_configuration,
    site_and_house,
)
from workbench.worlds.sites.ros_map import read_map, write_map
from workbench.worlds.sites.site import CannotStartThere, Site, load_site, starting_at

ROOM = """
lios_site: 1
name: room
start: {x_m: 1.0, y_m: 1.0}
rooms: [{id: room, kind: Kitchen, floor: [[0, 0], [4, 0], [4, 3], [0, 3]]}]
containers:
  - {id: fridge, type: Fridge, room: room, pose: {x_m: 3.5, y_m: 2.5}, size_m: [0.7, 0.7, 1.8], waypoint: a}
  - {id: table, type: DiningTable, room: room, pose: {x_m: 3.0, y_m: 0.5}, size_m: [1.0, 0.6, 0.7], waypoint: b}
tags: {7: {item: Mug|1, type: Mug}}
"""
MEASURED = "travel: {locations: [start, fridge, table], metres: [[0, 3, 2.5], [3, 0, 2], [2.5, 2, 0]]}\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "site.yaml"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def home() -> Site:
    return load_site("paper_home")


def test_the_papers_home_has_its_nine_containers_in_two_rooms(home: Site) -> None:
    rooms = {room.id: [c.id for c in home.plan.containers if c.room == room.id] for room in home.plan.rooms}
    assert rooms == {
        "kitchen": ["fridge", "dining_table", "countertop", "sink", "garbage_can"],
        "corridor": [],
        "bedroom": ["bed", "tv_stand", "desk", "couch"],
    }
    assert home.travel.unreachable == ()
    assert check_site(home) == ()


def test_the_shipped_map_is_the_shipped_plan(home: Site) -> None:
    assert home.grid is not None
    drawn = occupancy_of(home.plan, resolution_m=home.grid.resolution_m)
    assert np.array_equal(drawn.occupied, home.grid.occupied)


def test_ways_keep_clear_of_what_is_on_the_map_and_are_no_longer_than_they_cost(home: Site) -> None:
    ways = home.navigation
    assert home.grid is not None
    for a in home.travel.locations:
        for b in home.travel.locations:
            path = ways.path(a, b)
            assert path is not None
            walked = sum(hypot(q[0] - p[0], q[1] - p[1]) for p, q in pairwise(path))
            metres = home.travel.between(a, b)
            assert metres is not None
            assert metres * 0.9 - 0.2 <= walked <= metres + 0.2
            for p, q in pairwise(path):
                for share in np.linspace(0, 1, 50):
                    row, column = home.grid.cell_at((p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])))
                    assert not home.grid.occupied[row, column]


def test_the_robot_stands_in_the_containers_own_room_and_faces_it(home: Site) -> None:
    for container in home.plan.containers:
        pose = home.paths.standing_pose(LocationId(container.id))
        assert pose is not None
        xs = [x for x, _ in home.plan.room(container.room).floor]
        assert min(xs) < pose.x_m < max(xs)
        facing = np.arctan2(container.pose.y_m - pose.y_m, container.pose.x_m - pose.x_m)
        assert abs(np.angle(np.exp(1j * (facing - pose.yaw_rad)))) < 0.01


def test_configurations_are_the_papers(home: Site) -> None:
    known = configurations_of(home)
    holds = {n: {c: [i.type for i in items] for c, items in k.contents.items()} for n, k in known.items()}
    assert holds == {
        "A": {"countertop": ["WaterBottle"], "dining_table": ["CellPhone"]},
        "B": {"desk": ["WaterBottle"], "couch": ["CellPhone"]},
        "C": {"fridge": ["WaterBottle"], "desk": ["CellPhone"]},
        "D": {"fridge": ["WaterBottle"], "desk": ["CellPhone"]},
    }
    paper = {name: (r.seconds, r.searches) for name, r in known["A"].paper.items()}
    assert paper == {"pes-greedy": (311, 9), "pes-lios": (264, 6), "model-lios": (174, 2)}
    with pytest.raises(UnknownName, match="A, B, C, D"):
        pick_configuration(home, "E")


def test_a_configuration_moves_the_start_and_fills_the_house(home: Site) -> None:
    site, house = site_and_house(home, pick_configuration(home, "D"))
    assert site.plan.start.point == (6.0, 2.4)
    to_fridge, before = (
        site.travel.between(START, LocationId("fridge")),
        home.travel.between(START, LocationId("fridge")),
    )
    assert to_fridge is not None
    assert before is not None
    assert to_fridge < before - 3
    assert [item.type for item in house.contents["desk"]] == ["CellPhone"]  # type: ignore[index]
    assert site.travel.between(LocationId("bed"), LocationId("sink")) == home.travel.between(
        LocationId("bed"), LocationId("sink")
    )


def test_measured_travel_costs_are_taken_as_they_are(tmp_path: Path) -> None:
    site = load_site(written(tmp_path, ROOM + MEASURED))
    assert site.travel_source == "measured"
    assert site.travel.between(START, LocationId("table")) == 2.5
    assert site.paths.path(START, LocationId("table")) is not None
    assert starting_at(site, site.plan.start) == site
    with pytest.raises(CannotStartThere):
        starting_at(site, replace(site.plan.start, x_m=site.plan.start.x_m + 0.1))


def test_measured_travel_costs_from_a_csv_with_a_place_that_nobody_reaches(tmp_path: Path) -> None:
    (tmp_path / "travel.csv").write_text(",start,table,fridge\nstart,0,2.5,inf\ntable,2.5,0,\nfridge,inf,inf,0\n")
    site = load_site(written(tmp_path, ROOM + "travel: {file: travel.csv}\n"))
    assert site.travel.locations == ("start", "table")
    assert site.travel.unreachable == ("fridge",)
    assert any(f.level == "error" and "fridge" in f.where for f in check_site(site))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("rooms: [{id: room", "rooms: [{id: rom"), "room 'room', which is not there"),
        (("id: table", "id: fridge"), "fridge are taken twice"),
        (("item: Mug|1", "item: table"), "table is the id of a location and of an item"),
        (("item: Mug|1", "item: start"), "start is the id of a location and of an item"),
        (("size_m: [0.7, 0.7, 1.8]", "size_m: [0.7, -0.7, 1.8]"), r"\$.containers\[0\].size_m\[1\]"),
        (("waypoint: a", "way_point: a"), "way_point"),
        (("type: Mug}", "type: Mug, size_m: 0}"), r"size_m"),
        (("lios_site: 1", "lios_site: 1\ndetector: {kind: alvar}"), r"\$.detector.kind"),
        (("lios_site: 1", "lios_site: 9"), "version 9"),
        (("x_m: 1.0, y_m: 1.0", "x_m: oops, y_m: 1.0"), r"\$.start.x_m"),
        (("x_m: 1.0, y_m: 1.0", "x_m: .nan, y_m: 1.0"), r"."),
        (("[4, 0], [4, 3]", "[.nan, 0], [4, 3]"), "a number is .nan"),
        (("[4, 0], [4, 3]", "[1.0e+308, 0], [4, 3]"), r"\$.rooms\[0\].floor"),
        (("[4, 0], [4, 3]", "[.inf, 0], [4, 3]"), r"\$.rooms\[0\].floor"),
        (("size_m: [0.7, 0.7, 1.8]", "size_m: [.nan, 0.7, 1.8]"), "a number is .nan"),
        ((MEASURED, ""), "neither a map nor measured"),
        (("[0, 3, 2.5]", "[0, -3, 2.5]"), "negative"),
        (("[0, 3, 2.5], ", ""), "not a square matrix"),
        (("locations: [start, fridge", "locations: [start, frige"), "travel names frige"),
        (("lios_site: 1", "lios_site: [1"), "."),
    ],
)
def test_mistakes_in_a_survey_are_named_in_one_line(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    path = written(tmp_path, (ROOM + MEASURED).replace(*change))
    with pytest.raises((MalformedFile, BadValue), match=said) as caught:
        load_site(path)
    assert "\n" not in str(caught.value)


def test_missing_files_and_unknown_sites(tmp_path: Path) -> None:
    with pytest.raises(FileMissing):
        load_site(tmp_path / "nowhere.yaml")
    with pytest.raises(UnknownName, match="paper_home"):
        load_site("paper_hom")
    with pytest.raises(FileMissing, match=r"map.yaml"):
        load_site(written(tmp_path, ROOM + "map: map.yaml\n"))


def test_a_map_survives_writing_and_reading(tmp_path: Path) -> None:
    occupied = np.zeros((3, 5), dtype=bool)
    occupied[0, 1] = occupied[2, 4] = True
    write_map(OccupancyGrid(origin=(-1.0, 2.0), resolution_m=0.5, occupied=occupied), tmp_path / "m.yaml")
    again = read_map(tmp_path / "m.yaml")
    assert again.origin == (-1.0, 2.0)
    assert again.resolution_m == 0.5
    assert np.array_equal(again.occupied, occupied)


def test_what_map_saver_writes_is_read_as_ros_means_it(tmp_path: Path) -> None:
    """Two rows of pixels: top row occupied, unknown; bottom row free, occupied. The top row is the larger y."""
    (tmp_path / "m.pgm").write_bytes(b"P5\n# map_saver\n2 2\n255\n" + bytes((0, 205, 254, 0)))
    text = "image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    (tmp_path / "m.yaml").write_text(text)
    assert read_map(tmp_path / "m.yaml").occupied.tolist() == [[False, True], [True, True]]
    (tmp_path / "m.yaml").write_text(text.replace("negate: 0", "negate: 1"))
    assert read_map(tmp_path / "m.yaml").occupied.tolist() == [[True, False], [False, True]]
    (tmp_path / "m.pgm").write_bytes(b"no picture")
    (tmp_path / "m.yaml").write_text(text)
    with pytest.raises(MalformedFile, match="not a picture"):
        read_map(tmp_path / "m.yaml")


def test_rooms_that_overlap_are_found_and_those_that_share_a_thick_wall_are_not(tmp_path: Path) -> None:
    def said(left_m: float) -> list[str]:
        other = f"{{id: hall, kind: Hall, floor: [[{left_m}, 0], [8, 0], [8, 3], [{left_m}, 3]]}}]"
        site = load_site(written(tmp_path, (ROOM + MEASURED).replace("[0, 3]]}]", f"[0, 3]]}}, {other}")))
        return [finding.where for finding in check_site(site) if finding.what == "overlap"]

    assert said(3.0) == ["rooms room and hall"]
    assert said(3.8) == []


def test_the_check_finds_what_is_odd(tmp_path: Path) -> None:
    odd = (
        (ROOM + MEASURED)
        .replace("type: Fridge", "type: Frigde")
        .replace("kind: Kitchen", "kind: Unknown")
        .replace("waypoint: a", "waypoint: b")
        .replace("tags: {7: {item: Mug|1, type: Mug}}", "tags: {}")
        .replace("pose: {x_m: 3.0, y_m: 0.5}", "pose: {x_m: 9.0, y_m: 0.5}")
    )
    found = check_site(load_site(written(tmp_path, odd)))
    said = {(f.level, f.where) for f in found}
    assert ("error", "waypoints") in said
    assert ("warning", "container fridge") in said
    assert ("warning", "container table") in said
    assert ("warning", "tags") in said
    assert any(where.startswith("room ") for _, where in said)
    assert ("warning", "map") in said
    assert [f.level for f in found] == sorted((f.level for f in found), key=["error", "warning", "note"].index)


def surveyed(folder: Path, start: str, *, free_thresh: float = 0.196) -> Site:
    """A room of 4 m by 3 m with a column of unsurveyed ground in the middle."""
    pixels = np.full((30, 40), 254, dtype=np.uint8)
    pixels[:, 20] = 205
    (folder / "map.pgm").write_bytes(b"P5\n40 30\n255\n" + pixels.tobytes())
    (folder / "map.yaml").write_text(
        "image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n"
        f"occupied_thresh: 0.65\nfree_thresh: {free_thresh}\n"
    )
    text = ROOM.replace("start: {x_m: 1.0, y_m: 1.0}", f"start: {start}") + "map: map.yaml\n"
    return load_site(written(folder, text))


def test_small_tags_need_another_detector_than_the_robots(tmp_path: Path) -> None:
    small = ROOM.replace("type: Mug}", "type: Mug, size_m: 0.04}") + MEASURED
    for more, warned in (("", True), ("detector: {kind: opencv}\n", False)):
        found = check_site(load_site(written(tmp_path, small + more)))
        assert any("too small for Spot's own detector" in one.what for one in found) is warned


def test_unsurveyed_grey_that_the_thresholds_call_free_is_a_warning_with_the_number_of_cells(tmp_path: Path) -> None:
    said = [f.what for f in check_site(surveyed(tmp_path, "{x_m: 1.0, y_m: 1.0}", free_thresh=0.25))]
    assert any("30 cells" in what and "205" in what for what in said)
    said = [f.what for f in check_site(surveyed(tmp_path, "{x_m: 1.0, y_m: 1.0}"))]
    assert not any("205" in what for what in said)
    assert "cannot be reached from the start" in said


def test_a_start_off_the_map_is_told_and_no_count_is_below_zero(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    site = surveyed(tmp_path, "{x_m: 40.0, y_m: 1.0}")
    assert any(f.where == "start" and "off the map" in f.what for f in check_site(site))
    with pytest.raises(Failed, match="1 finding would"):
        check(str(site.path))
    assert "0 containers reachable" in capsys.readouterr().out


def test_configurations_with_mistakes(tmp_path: Path, home: Site) -> None:
    path = tmp_path / "c.yaml"
    head = "lios_configurations: 1\nconfigurations:\n  A: {start: {x_m: 1, y_m: 1}, contents: "
    path.write_text(head + "{wardrobe: [CellPhone|1]}}\n")
    with pytest.raises(MalformedFile, match="wardrobe"):
        load_configurations(path, home)
    path.write_text(head + "{bed: [Apple|1]}}\n")
    with pytest.raises(MalformedFile, match="without a tag: Apple"):
        load_configurations(path, home)
