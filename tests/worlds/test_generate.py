"""Generated houses: connected, reachable, plausible, the same for the same seed."""

from __future__ import annotations

import hashlib
from itertools import combinations
from pathlib import Path

import pytest

from workbench.errors import BadValue
from workbench.worlds.generator.contents import SCENARIO_ITEMS
from workbench.worlds.generator.generate import generate_houses, write_houses
from workbench.worlds.generator.statistics import shipped_statistics, statistics_json
from workbench.worlds.geometry import footprint
from workbench.worlds.house import START, House, LocationId
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.procthor.load import house_from_json, load_houses
from workbench.worlds.shipped import shipped_houses


def houses(count: int, *, seed: int, rooms: tuple[int, int] = (2, 10), stocked: bool = False) -> list[House]:
    made = generate_houses(count, seed=seed, rooms=rooms, stocked=stocked)
    return [house_from_json(record, name=f"g:{i}") for i, record in enumerate(made)]


@pytest.mark.parametrize("rooms", [1, 2, 3, 6, 9, 12])
def test_every_size_is_connected_and_every_container_reachable(rooms: int) -> None:
    for house in houses(2, seed=rooms, rooms=(rooms, rooms)):
        travel = navigate(house.plan).travel
        assert len(house.plan.rooms) == rooms
        assert house.plan.containers
        assert travel.unreachable == ()


def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    digests: list[str] = []
    for name in ("one.jsonl.gz", "two.jsonl.gz"):
        assert write_houses(tmp_path / name, generate_houses(3, seed=5)) == 3
        digests.append(hashlib.sha256((tmp_path / name).read_bytes()).hexdigest())
    assert digests[0] == digests[1]
    write_houses(tmp_path / "three.jsonl.gz", generate_houses(3, seed=6))
    assert hashlib.sha256((tmp_path / "three.jsonl.gz").read_bytes()).hexdigest() != digests[0]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["one.jsonl.gz", "three.jsonl.gz", "two.jsonl.gz"]


def test_a_house_depends_on_its_number_alone() -> None:
    assert list(generate_houses(4, seed=3))[:2] == list(generate_houses(2, seed=3))


def test_rooms_do_not_overlap_and_furniture_stays_in_them() -> None:
    for house in houses(3, seed=11, rooms=(4, 8)):
        boxes = [(min(x), min(y), max(x), max(y)) for x, y in (zip(*r.floor, strict=True) for r in house.plan.rooms)]
        for a, b in combinations(boxes, 2):
            assert min(a[2], b[2]) - max(a[0], b[0]) < 1e-6 or min(a[3], b[3]) - max(a[1], b[1]) < 1e-6
        floors = {room.id: box for room, box in zip(house.plan.rooms, boxes, strict=True)}
        for thing in house.plan.containers:
            x0, y0, x1, y1 = floors[thing.room]
            for x, y in footprint(thing.pose, thing.size_m[0], thing.size_m[1]):
                assert x0 - 0.01 <= x <= x1 + 0.01
                assert y0 - 0.01 <= y <= y1 + 0.01


def test_contents_make_sense() -> None:
    """Toilet paper is by toilets and eggs are in kitchens, pillows on beds and sofas."""
    seen: dict[str, set[str]] = {}
    for house in houses(12, seed=1):
        for container in house.plan.containers:
            for item in house.contents[container.id]:
                seen.setdefault(item.type, set()).add(container.type)
    assert seen["Egg"] <= {"Fridge", "CounterTop", "DiningTable"}
    assert seen["Pillow"] <= {"Bed", "Sofa", "ArmChair"}
    assert seen["ToiletPaper"] <= {"Toilet", "GarbageCan"}


def test_a_stocked_kitchen_has_what_the_scenarios_need() -> None:
    for house in houses(4, seed=2, rooms=(4, 6), stocked=True):
        if any(room.kind == "Kitchen" for room in house.plan.rooms):
            assert set(SCENARIO_ITEMS) <= set(house.item_types())


def test_the_shipped_houses() -> None:
    shipped = load_houses(shipped_houses())
    assert len(shipped) == 24
    sizes = {len(house.plan.rooms) for house in shipped}
    assert min(sizes) == 2
    assert max(sizes) == 10
    for house in shipped:
        travel = navigate(house.plan).travel
        assert travel.unreachable == ()
        assert len(house.plan.containers) >= 5
        assert travel.between(START, LocationId(house.plan.containers[0].id)) is not None
    for item in SCENARIO_ITEMS:
        assert sum(item in house.item_types() for house in shipped) >= 20


def test_the_shipped_houses_come_from_the_command_that_is_said_to_make_them(tmp_path: Path) -> None:
    write_houses(tmp_path / "houses.jsonl.gz", generate_houses(24, seed=2082, stocked=True))
    made, shipped = load_houses(tmp_path / "houses.jsonl.gz"), load_houses(shipped_houses())
    assert [h.plan.containers for h in made] == [h.plan.containers for h in shipped]
    assert [h.contents for h in made] == [h.contents for h in shipped]


def test_numbers_out_of_range() -> None:
    for rooms in ((0, 3), (5, 2), (2, 99)):
        with pytest.raises(BadValue, match="rooms"):
            list(generate_houses(1, seed=0, rooms=rooms))
    with pytest.raises(BadValue, match="number of houses is 0; it must be at least 1"):
        list(generate_houses(0, seed=0))


def test_nothing_is_left_behind_when_writing_fails(tmp_path: Path) -> None:
    def failing() -> object:
        yield from generate_houses(1, seed=0)
        raise RuntimeError("stop")

    with pytest.raises(RuntimeError):
        write_houses(tmp_path / "x.jsonl.gz", failing())  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []


def test_the_statistics_are_those_of_the_training_houses(procthor: Path) -> None:
    from workbench.evaluation.splits import split_indices
    from workbench.worlds.generator.statistics import measure

    training: list[House] = []
    for name in ("multi_room_train.jsonl.gz", "single_room_train.jsonl.gz"):
        loaded = load_houses(procthor / name)
        training += [loaded[i] for i in split_indices(procthor / name, "train", houses=len(loaded))]
    kept = shipped_statistics()
    assert statistics_json(measure(training, made_by=kept.made_by)) == statistics_json(kept)
