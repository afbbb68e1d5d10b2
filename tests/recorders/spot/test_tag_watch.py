"""Tags in passing: the robot turns for an item that it looks for, and a replay of its log does the same."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from bosdyn.api import world_object_pb2
from bosdyn.api.graph_nav import nav_pb2
from spot_help import placed, robot, run_of

from recorders.spot.client.control import Control
from recorders.spot.run.operator import AgreeingOperator
from recorders.spot.run.run import run_and_record
from recorders.spot.run.run_settings import RunSettings
from recorders.spot.run.site_tasks import place_of
from recorders.spot.run.tag_watch import tag_watch
from recorders.spot.run.world import SpotWorld
from replayers.batch.verify import verify
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.replay import replay_on
from replayers.evaluation.spot_experiment import cost_by_the_matrix
from replayers.runs.run import Run, read
from workbench.log_schema.tags_in_passing_json import SETTING, tags_of
from workbench.worlds.house import ContainerId, ItemType, LocationId
from workbench.worlds.sight.sightings import stop_point
from workbench.worlds.sites.measured_lengths import MeasuredNavigation
from workbench.worlds.world import ActionDone

Tag = world_object_pb2.AprilTagProperties
PHONE, TABLE = "CellPhone|1", ContainerId("dining_table")


def driven(folder: Path, **settings: float) -> Run:
    """PesLIOS in configuration A, where the phone lies on the dining table, which it passes on its way to the
    countertop."""
    path = folder / "run.mcap"
    with robot() as (spot, connection):
        wanted = run_of(spot, "pes-lios", **settings)
        run_and_record(connection, replace(wanted, estimator="fcnn"), path, operator=AgreeingOperator())
    return read(path)


def test_the_robot_turns_for_a_tag_in_passing_and_the_log_reproduces_it(tmp_path: Path) -> None:
    run = driven(tmp_path)
    seen = next(s for s in run.sightings if s.item.id == PHONE)
    assert seen.container == TABLE
    assert TABLE not in {o.container for o in run.observations}, "it was not looked into"
    assert not any(a.action == "search" and a.target == TABLE for a in run.actions)
    turned = next(a for a in run.actions if a.decision == seen.decision and a.action == "move")
    assert stop_point(turned.target) is not None, "it turned at once, on its way"
    after = next(p for p in run.plans if p.decision == seen.decision + 1)
    assert after.reason == f"saw {PHONE} in {TABLE} in passing"
    assert after.robot_at == turned.target
    assert any(a.action == "pick" and a.target == TABLE and PHONE in a.items and a.success for a in run.actions)
    assert run.outcome is not None
    assert run.outcome.status == "done"
    verified = verify(run)
    assert verified.same, verified.divergence
    ground = prepare_log(run, ReplaySettings(worlds=0))
    assert ground.reproduction.same
    assert [item.id for item in ground.evidence.partly[TABLE]] == [PHONE]
    assert TABLE in ground.evidence.open, "what else lies there is unknown"
    again = replay_on(ground, "pes-lios")
    assert again.status.value == "done", "over the log alone, what was seen then is seen again"
    assert "imputed" not in again.support
    assert not any("deterministic" in note for note in again.notes)
    bounds = again.bounds
    assert bounds is not None
    assert bounds.lower - 1e-6 <= cost_by_the_matrix(run) <= bounds.upper + 1e-6


@pytest.mark.ci
def test_without_it_nothing_changes(tmp_path: Path) -> None:
    run = driven(tmp_path, sees_m=0.0)
    assert run.sightings == ()
    assert SETTING not in run.settings
    assert TABLE in {o.container for o in run.observations}
    assert verify(run).same
    assert replay_on(prepare_log(run, ReplaySettings(worlds=0)), "pes-lios").exact


def test_a_robot_turns_where_its_way_is_nearest_to_the_container_or_soon_after() -> None:
    site, _ = placed()
    tags = tags_of(place_of(site), 3.0, (TABLE,))
    a, b = LocationId("desk"), LocationId("countertop")
    points = tags.turning_points(a, b, TABLE)
    view = next(s for s in tags.in_view(a, b) if s.container == TABLE)
    metres = site.travel.between(a, b)
    assert metres is not None
    assert points
    assert all(view.along_m - 1e-9 <= point.along_m <= metres - 0.5 for point in points)
    steps = [late.along_m - early.along_m for early, late in pairwise(points)]
    assert all(0.9 < step < 1.2 for step in steps)
    for point in points:  # going on along a way brings nothing nearer by more than was walked
        left = tags.travel_from(point.location).between(point.location, b)
        assert left is not None
        assert point.along_m + left == pytest.approx(metres, abs=0.15)
    assert tags.turning_points(a, LocationId(TABLE), TABLE) == (), "it looks into where it goes"


def test_tags_in_closed_furniture_and_on_ways_that_nobody_knows_do_not_count() -> None:
    site, _ = placed()
    closed = {entry.id for entry in site.file.containers if entry.closed}
    assert closed
    with robot() as (_, connection):
        world = SpotWorld(connection=connection, control=Control(connection), site=site, settings=RunSettings())
        watch = tag_watch(world, [item.type for item in site.tags.values()])
        assert watch is not None
        assert not closed & set(watch.paths.containers)
        world.settings = RunSettings(sees_m=0.0)
        assert tag_watch(world, []) is None
        lengths = MeasuredNavigation(travel=site.travel, standing=site.navigation.standing)
        world.site, world.settings = replace(site, navigation=lengths), RunSettings()
        assert tag_watch(world, []) is None, "no way is known on which something could come into view"


@pytest.mark.ci
def test_an_unsure_detection_is_not_enough() -> None:
    with robot() as (spot, connection), Control(connection, own_estop=True) as control:
        connection.client("graph-nav-service").set_localization(nav_pb2.Localization(), fiducial_init=2)
        site, _ = placed()
        settings = RunSettings(poll_s=0.5, furniture_open=True)
        world = SpotWorld(connection=connection, control=control, site=site, settings=settings)
        world.watch = tag_watch(world, [item.type for item in site.tags.values()])
        unsure, sure_of_it = Tag.STATUS_AMBIGUOUS, Tag.STATUS_OK
        for status in (unsure, sure_of_it):
            spot.state.tag_status = status
            assert isinstance(world.go_to(LocationId("desk"), seeking=None), ActionDone)
            went = world.go_to(LocationId("countertop"), seeking=[ItemType("CellPhone")])
            assert isinstance(went, ActionDone)
            assert bool(went.items_seen) is (status is sure_of_it)
            assert (went.ended_at is not None) is (status is sure_of_it)
