"""Tags that the simulated detector misses: by hand, the same again, and more of them from afar and aslant."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from pathlib import Path

import msgspec
import pytest
from spot_help import placed, robot, run_of

from recorders.spot.run.run import run_and_record, setup_of
from recorders.spot.simulated.missed_tags import MissedTags, angle_of_view
from recorders.spot.simulated.sight import thing_in
from replayers.batch.verify import verify
from replayers.runs.run import read
from workbench.cli import run as lios
from workbench.errors import BadValue
from workbench.worlds.geometry import Pose
from workbench.worlds.house import ContainerId, ItemType, LocationId
from workbench.worlds.sites.survey_schema import DetectorEntry

DESK = ContainerId("desk")


def test_by_hand_what_a_viewpoint_shows() -> None:
    """At the limit of 3 m nothing; at half of it three quarters, of which half is left at 60 degrees."""
    sharp = MissedTags(rate=0.0)
    assert sharp.detects(0.0, 0.0) == 1.0
    assert sharp.detects(3.0, 0.0) == 0.0
    assert sharp.detects(1.5, 0.0) == 0.75
    assert sharp.detects(1.5, pi / 3) == pytest.approx(0.375)
    assert sharp.detects(0.1, pi / 2 + 0.1) == 0.0
    assert MissedTags(rate=0.2).detects(1.5, 0.0) == pytest.approx(0.6)
    assert sharp.detects(0.75, 0.0, 0.073) == 0.75, "a tag half as large is as good as one twice as far away"
    assert sharp.detects(0.75, 0.0, 0.2) == 1 - 0.25**2, "a larger one is not seen better"


@pytest.mark.parametrize("rate", [-0.1, 1.0])
def test_a_rate_outside_is_refused(rate: float) -> None:
    with pytest.raises(BadValue, match="at least 0 and below 1"):
        MissedTags(rate=rate)


def test_the_angle_is_that_to_where_one_stands() -> None:
    site, _ = placed("A")
    thing = thing_in(101, site.plan.container(DESK), 0)
    stand = site.navigation.standing[LocationId(DESK)]
    assert angle_of_view(site, stand, thing) == pytest.approx(0.0)
    x, y = thing.position[:2]
    behind = Pose(x_m=2 * x - stand.x_m, y_m=2 * y - stand.y_m, yaw_rad=0.0)
    assert angle_of_view(site, behind, thing) == pytest.approx(pi)
    assert angle_of_view(site, behind, replace(thing, container=None)) == 0.0


def test_one_viewpoint_misses_always_the_same_and_all_miss_as_often_as_they_should() -> None:
    site, _ = placed("A")
    thing = thing_in(101, site.plan.container(DESK), 0)
    at = site.navigation.standing[LocationId(DESK)]
    missed = MissedTags(rate=0.3, seed=4)
    chance = missed.detects(
        ((thing.position[0] - at.x_m) ** 2 + (thing.position[1] - at.y_m) ** 2) ** 0.5, 0.0, thing.size_m
    )
    assert len({missed.misses(site, at, thing) for _ in range(5)}) == 1
    drawn = [MissedTags(rate=0.3, seed=seed).misses(site, at, thing) for seed in range(4000)]
    assert sum(drawn) / 4000 == pytest.approx(1 - chance, abs=0.03)


@pytest.mark.ci
def test_a_robot_that_misses_most_tags_finds_nothing_and_the_same_run_again(tmp_path: Path) -> None:
    logs: list[Path] = []
    for number in range(2):
        with robot(configuration="C") as (spot, connection):
            with spot.state.alive() as state:
                state.missed_tags = MissedTags(rate=0.99, seed=1)
            logs.append(tmp_path / f"{number}.mcap")
            report = run_and_record(connection, run_of(spot, "pes-greedy"), logs[-1])
        assert report.ended.status != "done"
    first, second = (read(log) for log in logs)
    assert first.observations == second.observations
    assert not any(seen.items for seen in first.observations)


def test_the_sites_file_says_how_surely_looks_detect() -> None:
    with robot(configuration="C") as (spot, _):
        run = run_of(spot, "pes-greedy")
        assert setup_of(run).perception.perfect
        detector = DetectorEntry(p_detect=0.9, p_detect_of={"CellPhone": 0.6})
        site = replace(run.site, file=msgspec.structs.replace(run.site.file, detector=detector))
        told = setup_of(replace(run, site=site)).perception
    assert [told.of(ItemType(name)) for name in ("CellPhone", "WaterBottle")] == [0.6, 0.9]
    assert (told.source, told.detector) == ("site", "robot")


@pytest.mark.ci
def test_a_robot_that_knows_of_misses_looks_again_and_its_log_verifies(tmp_path: Path) -> None:
    """From one viewpoint the simulated detector misses the same again, so most of what it missed stays missed."""
    with robot(configuration="A") as (spot, connection):
        with spot.state.alive() as state:
            state.missed_tags = MissedTags(rate=0.99, seed=1)
        run = run_of(spot, "pes-greedy")
        detector = DetectorEntry(p_detect=0.7)
        site = replace(run.site, file=msgspec.structs.replace(run.site.file, detector=detector))
        log = tmp_path / "run.mcap"
        run_and_record(connection, replace(run, site=site, task=replace(run.task, available=())), log)
    told = read(log)
    looks = [seen.look for seen in told.observations if not seen.known_at_start]
    assert {look.source for look in looks if look is not None} == {"site"}
    assert max(look.number for look in looks if look is not None) == 3
    assert verify(told).same


def test_the_command_refuses_a_rate_outside(capsys: pytest.CaptureFixture[str]) -> None:
    assert lios(["spot", "simulate", "--port", "0", "--for", "0", "--miss-rate", "1.5"]) == 2
    assert "miss rate is 1.5" in capsys.readouterr().err
