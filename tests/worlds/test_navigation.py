"""Grids, shortest paths, standing poses, the cache. The toy house is worked out by hand; paths are compared with
scipy's."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise
from math import cos, hypot, sin, sqrt
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra
from toy import BED, FRIDGE, TABLE, toy_plan, toy_travel

from workbench.errors import BadValue
from workbench.worlds.geometry import Pose
from workbench.worlds.house import START, Container, ContainerId, LocationId, RoomId
from workbench.worlds.maps import travel_cache
from workbench.worlds.maps.connectivity import inside
from workbench.worlds.maps.navigation import NowhereToStand, compute, navigate
from workbench.worlds.maps.occupancy import OccupancyGrid, occupancy_of
from workbench.worlds.maps.path_simplification import corner_cells
from workbench.worlds.maps.shortest_paths import pairwise_steps, shortest_path


def test_grid_of_the_toy_house() -> None:
    grid = occupancy_of(toy_plan())

    def occupied(x: float, y: float) -> bool:
        return bool(grid.occupied[grid.cell_at((x, y))])

    assert not occupied(1, 2)  # the start
    assert occupied(0.5, 3.5)  # in the fridge
    assert occupied(4, 0.7)  # in the wall between the rooms
    assert not occupied(4, 2)  # in its door
    assert occupied(-0.2, 2)  # outside
    assert not occupied(3.5, 2)


def test_a_shut_door_and_an_open_wall() -> None:
    plan = toy_plan()
    shut = replace(plan, doors=tuple(replace(d, passable=False) for d in plan.doors))
    assert occupancy_of(shut).occupied[occupancy_of(shut).cell_at((4, 2))]
    assert set(compute(shut, resolution_m=0.1, robot_radius_m=0.2).travel.unreachable) == {"Bed|2", "Desk|2"}
    opened = replace(shut, walls=tuple(replace(w, empty=w.id == "w5") for w in plan.walls))
    assert compute(opened, resolution_m=0.1, robot_radius_m=0.2).travel.unreachable == ()


def test_cells_and_points_are_each_others_inverse() -> None:
    grid = OccupancyGrid(origin=(-1.0, 2.0), resolution_m=0.1, occupied=np.zeros((5, 7), dtype=bool))
    for row in range(5):
        for column in range(7):
            assert grid.cell_at(grid.point_at(row, column)) == (row, column)
    assert grid.point_at(0, 0) == pytest.approx((-0.95, 2.05))


def test_travel_costs_of_the_toy_house() -> None:
    """From the start (1, 2) to the fridge's corner region and through the door to the bed."""
    navigation = compute(toy_plan(), resolution_m=0.1, robot_radius_m=0.2)
    travel = navigation.travel
    assert travel.locations[0] == START
    assert travel.unreachable == ()
    straight = hypot(6.8 - 1.0, 3.0 - 2.0)
    to_bed = travel.between(START, LocationId(BED))
    assert to_bed is not None
    assert 4 < to_bed < straight + 1
    assert (travel.metres == travel.metres.T).all()
    assert (np.diag(travel.metres) == 0).all()


def test_a_container_is_approached_from_its_own_room() -> None:
    """A shelf against the bedroom's side of the wall: the kitchen's floor is as near, but behind the wall."""
    plan = toy_plan()
    shelf = Container(
        id=ContainerId("ShelvingUnit|9"),
        type="ShelvingUnit",
        room=RoomId("room|2"),
        pose=Pose(x_m=4.05, y_m=0.6),
        size_m=(0.1, 0.8, 1.5),
    )
    plan = replace(plan, containers=(*plan.containers, shelf))
    pose = navigate(plan).standing_pose(LocationId(shelf.id))
    assert pose is not None
    assert inside(pose.point, plan.room(RoomId("room|2")).floor)
    assert cos(pose.yaw_rad) < 0  # looks back at the shelf


def test_a_walled_in_container_is_named_and_never_given_a_number() -> None:
    plan = toy_plan()
    boxes = [
        Container(
            id=ContainerId(f"Box|{i}"), type="Box", room=RoomId("room|1"), pose=Pose(x_m=x, y_m=y), size_m=(w, d, 0.5)
        )
        for i, (x, y, w, d) in enumerate(
            [(0.3, 0.3, 0.2, 0.2), (1.5, 0.2, 0.4, 3.0), (0.6, 1.6, 1.8, 0.2), (1.4, 0.8, 0.2, 1.6)]
        )
    ]
    plan = replace(plan, containers=(*plan.containers, *boxes))
    travel = navigate(plan).travel
    assert "Box|0" in travel.unreachable
    assert travel.between(START, LocationId("Box|0")) is None
    assert navigate(plan).path(START, LocationId("Box|0")) is None
    assert navigate(plan).standing_pose(LocationId("Box|0")) is None


def test_ways_are_as_long_as_they_cost_and_keep_their_distance() -> None:
    plan = toy_plan()
    navigation = navigate(plan)
    for a in navigation.travel.locations:
        for b in navigation.travel.locations:
            path = navigation.path(a, b)
            pose_a, pose_b = navigation.standing_pose(a), navigation.standing_pose(b)
            assert path is not None
            assert pose_a is not None
            assert pose_b is not None
            assert (path[0], path[-1]) == (pytest.approx(pose_a.point), pytest.approx(pose_b.point))
            length = sum(hypot(q[0] - p[0], q[1] - p[1]) for p, q in pairwise(path))
            assert length == pytest.approx(navigation.travel.between(a, b))
            for p, q in pairwise(path):
                for t in np.linspace(0, 1, 50):
                    cell = navigation.grid.cell_at((p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])))
                    assert not navigation.grid.occupied[cell]


def test_the_robot_faces_what_it_uses() -> None:
    navigation = navigate(toy_plan())
    for container in toy_plan().containers:
        pose = navigation.standing_pose(LocationId(container.id))
        assert pose is not None
        dx, dy = container.pose.x_m - pose.x_m, container.pose.y_m - pose.y_m
        assert cos(pose.yaw_rad) * dx + sin(pose.yaw_rad) * dy == pytest.approx(hypot(dx, dy))


def grids() -> st.SearchStrategy[npt.NDArray[np.bool_]]:
    def build(seed: int, rows: int, columns: int, share: float) -> npt.NDArray[np.bool_]:
        free = np.zeros((rows + 2, columns + 2), dtype=bool)
        free[1:-1, 1:-1] = np.random.default_rng(seed).random((rows, columns)) >= share
        free[1, 1] = True
        return free

    return st.builds(build, st.integers(0, 10_000), st.integers(1, 14), st.integers(1, 14), st.floats(0, 0.5))


def reference(free: npt.NDArray[np.bool_]) -> npt.NDArray[np.float64]:
    """All-pairs steps by scipy's Dijkstra, corners of obstacles not cut."""
    rows, columns = free.shape
    entries: list[tuple[int, int, float]] = []
    for r, c in zip(*np.nonzero(free), strict=True):
        for dr in (-1, 0, 1):
            for dc in (-1, 0, 1):
                if (dr, dc) != (0, 0) and free[r + dr, c + dc] and free[r + dr, c] and free[r, c + dc]:
                    entries.append((r * columns + c, (r + dr) * columns + c + dc, sqrt(dr * dr + dc * dc)))
    size = rows * columns
    if not entries:
        return np.where(np.eye(size, dtype=bool), 0.0, np.inf)
    i, j, w = zip(*entries, strict=True)
    return np.asarray(dijkstra(coo_matrix((w, (i, j)), shape=(size, size)).tocsr()))


@settings(max_examples=60, deadline=None)
@given(grids())
def test_steps_are_those_of_dijkstra(free: npt.NDArray[np.bool_]) -> None:
    cells = np.flatnonzero(free)
    assert np.allclose(pairwise_steps(free, cells), reference(free)[np.ix_(cells, cells)])


@settings(max_examples=60, deadline=None)
@given(grids(), st.integers(0, 1000))
def test_corners_keep_the_length_and_stay_on_free_cells(free: npt.NDArray[np.bool_], pick: int) -> None:
    cells = np.flatnonzero(free)
    source, target = int(cells[0]), int(cells[pick % len(cells)])
    steps = reference(free)[source, target]
    found = shortest_path(free, source, target)
    if not np.isfinite(steps):
        assert found is None
        return
    assert found is not None
    corners = corner_cells(free, found)
    assert sum(hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(corners)) == pytest.approx(steps)
    for a, b in pairwise(corners):
        n = max(abs(b[0] - a[0]), abs(b[1] - a[1]))
        assert abs(b[0] - a[0]) in (0, n)
        assert abs(b[1] - a[1]) in (0, n)
        for k in range(n + 1):
            assert free[a[0] + (b[0] - a[0]) // n * k, a[1] + (b[1] - a[1]) // n * k]


def test_the_indices_of_several_locations_are_those_of_each() -> None:
    travel = toy_travel()
    some = (travel.locations[3], travel.locations[0], travel.locations[3])
    assert travel.rows(some).tolist() == [3, 0, 3] == travel.rows(some).tolist()
    assert travel.reaches_all(some)
    assert not travel.reaches_all((*some, "Box|0"))
    with pytest.raises(KeyError):
        travel.rows((*some, "Box|0"))


def test_travel_costs_are_equal_by_value() -> None:
    travel = navigate(toy_plan()).travel
    again = replace(travel, metres=travel.metres.copy())
    assert travel == again
    assert hash(travel) == hash(again)
    assert travel != replace(travel, metres=travel.metres * 2)
    assert travel != "another thing"


def test_the_cache_gives_the_same_again_and_survives_damage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIOS_CACHE", str(tmp_path))
    first = navigate(toy_plan())
    (kept,) = [p for p in tmp_path.rglob("*") if p.is_file()]
    again = navigate(toy_plan())
    assert again is not first
    assert (again.travel.metres == first.travel.metres).all()
    assert (again.grid.occupied == first.grid.occupied).all()
    assert again.standing == first.standing
    assert again.path(START, LocationId(FRIDGE)) == first.path(START, LocationId(FRIDGE))
    for damage in (b"", b"PK\x03\x04 nonsense", kept.read_bytes()[:-100]):
        kept.write_bytes(damage)
        assert (navigate(toy_plan()).travel.metres == first.travel.metres).all()


def test_many_at_once_share_one_entry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIOS_CACHE", str(tmp_path))
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda _: navigate(toy_plan()), range(24)))
    assert all(one.travel == found[0].travel for one in found)
    assert [p.suffix for p in tmp_path.rglob("*") if p.is_file()] == [".npz"]


def test_another_house_or_setting_is_another_entry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LIOS_CACHE", str(tmp_path))
    plan = toy_plan()
    moved = replace(
        plan, containers=(*plan.containers[:-1], replace(plan.containers[-1], pose=Pose(x_m=7.3, y_m=0.7)))
    )
    navigate(plan)
    navigate(moved)
    navigate(plan, robot_radius_m=0.3)
    assert len(list(tmp_path.rglob("*.npz"))) == 3


def test_nothing_is_kept_when_the_cache_is_off_or_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LIOS_CACHE", "off")
    assert travel_cache.cache_folder() is None
    navigate(toy_plan())
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("LIOS_CACHE", str(tmp_path / "file"))
    assert navigate(toy_plan()).travel.reaches(LocationId(TABLE))
    assert sorted(os.listdir(tmp_path)) == ["file"]


def test_settings_and_houses_that_cannot_be() -> None:
    with pytest.raises(BadValue, match="resolution_m"):
        navigate(toy_plan(), resolution_m=0)
    with pytest.raises(BadValue, match="robot_radius_m"):
        navigate(toy_plan(), robot_radius_m=-1)
    with pytest.raises(NowhereToStand, match="no floor is free"):
        navigate(toy_plan(), robot_radius_m=3)


def test_where_compiled_code_cannot_be_kept_it_is_compiled_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    import numba

    from workbench.worlds.maps import shortest_paths

    real = numba.njit

    def no_folder(*args: object, cache: bool = False) -> object:
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return real(*args)

    monkeypatch.setattr(numba, "njit", no_folder)

    @shortest_paths._compiled(numba.int64(numba.int64))
    def twice(n: int) -> int:
        return 2 * n

    assert twice(21) == 42
