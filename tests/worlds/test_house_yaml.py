"""Houses in YAML: the template records and replays exactly; what is wrong with a file is one line."""

from __future__ import annotations

from pathlib import Path

import pytest

import recorders
import replayers
from workbench import cli
from workbench.errors import LiosError, NotFound
from workbench.worlds.house import ContainerId, ItemType
from workbench.worlds.house_yaml import load_house_yaml
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.procthor.load import load_house

HOUSE = """
lios_house: 1
start: [1, 1]
rooms:
  a: {kind: Kitchen, floor: [0, 0, 4, 3]}
  b: {kind: Bedroom, floor: [8, 3, 4, 0]}
doors: [[4, 1.5]]
containers:
  fridge: {type: Fridge, box: [0.2, 2.2, 0.8, 2.8], holds: [Egg, Egg]}
  bed: {type: Bed, box: [6, 1, 7.5, 2.5], height_m: 0.5, holds: [Egg]}
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "flat.yaml"
    path.write_text(text)
    return path


def test_rooms_containers_and_contents(tmp_path: Path) -> None:
    house = load_house(str(written(tmp_path, HOUSE)))
    assert house.plan.name == "flat"
    fridge, bed = house.plan.containers
    assert (fridge.room, bed.room) == ("a", "b")
    assert fridge.size_m == pytest.approx((0.6, 0.6, 0.8))
    assert (bed.pose.x_m, bed.pose.y_m) == (6.75, 1.75)
    assert house.holders(ItemType("Egg")) == ("fridge", "bed")
    assert [item.id for item in house.contents[ContainerId("bed")]] == ["Egg|3"]


def test_the_robot_walks_through_the_door(tmp_path: Path) -> None:
    travel = navigate(load_house_yaml(written(tmp_path, HOUSE)).plan).travel
    assert travel.unreachable == ()
    assert travel.locations == ("start", "fridge", "bed")


def test_rooms_above_each_other_share_a_wall_too(tmp_path: Path) -> None:
    above = HOUSE.replace("[8, 3, 4, 0]", "[0, 3, 4, 6]").replace("[[4, 1.5]]", "[[2, 3]]")
    above = above.replace("box: [6, 1, 7.5, 2.5]", "box: [2, 4, 3.5, 5.5]")
    assert navigate(load_house_yaml(written(tmp_path, above)).plan).travel.unreachable == ()


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("[8, 3, 4, 0]", "[8, 3, 3, 0]", "rooms a and b overlap"),
        ("[[4, 1.5]]", "[[5, 1.5]]", "door [5.0, 1.5] is on no wall that two rooms share"),
        ("[[4, 1.5]]", "[]", "1 of 2 rooms cannot be entered"),
        ("[6, 1, 7.5, 2.5]", "[6, 1, 9.5, 2.5]", "container bed is in no room"),
        ("start: [1, 1]", "start: [9, 9]", "start is in no room"),
        ("[6, 1, 7.5, 2.5]", "[6, 1, 6, 2.5]", "the box of bed is [6.0, 1.0, 6.0, 2.5]"),
        ("[0, 0, 4, 3]", "[.nan, 0, 4, 3]", "the floor of a is"),
        ("  bed:", "  start:", "named start"),
        ("lios_house: 1", "lios_house: 2", "version 2"),
        ("kind: Kitchen", "colour: red", "colour"),
        ("lios_house: 1", "lios_site: 1", "a survey of a real place"),
        (HOUSE, "- 1", "Expected"),
        (HOUSE, "a: [", "flat.yaml"),
    ],
)
def test_what_is_wrong_is_one_line(old: str, new: str, why: str, tmp_path: Path) -> None:
    assert old in HOUSE
    with pytest.raises(LiosError) as told:
        load_house_yaml(written(tmp_path, HOUSE.replace(old, new)))
    assert why in str(told.value)
    assert "\n" not in str(told.value)
    assert told.value.exit_code == 2


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ("evaluate search --houses flat.yaml --queries 1 -o e", "flat.yaml: one place in YAML, which --house takes"),
        ("site check flat.yaml", "flat.yaml: a house, and not a survey"),
    ],
)
def test_where_no_house_of_ones_own_is_taken_a_line_says_what_it_is(
    words: str, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    written(tmp_path, HOUSE)
    monkeypatch.chdir(tmp_path)
    assert cli.run(words.split()) == 2
    assert capsys.readouterr().err.startswith(f"lios: {why}")


def test_a_number_alone_names_what_to_give() -> None:
    with pytest.raises(NotFound, match="houses:9"):
        load_house("9")


def test_the_template_records_and_replays_exactly(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.run(["new", "house", "my-flat"]) == 0
    assert capsys.readouterr().out.strip() == "my-flat.yaml"
    assert len(Path("my-flat.yaml").read_text().splitlines()) <= 15
    end = recorders.record("run.mcap", house="my-flat.yaml", find="mug", strategy="greedy")
    assert end.status == "done"
    (made,) = replayers.replay("run.mcap", "greedy", settings=replayers.ReplaySettings(worlds=10))
    assert made.exact
    assert made.cost == pytest.approx(end.cost)
    assert cli.run(["new", "house", "my-flat"]) == 2
    assert cli.run(["new", "house", "../x"]) == 2
