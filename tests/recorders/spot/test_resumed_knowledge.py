"""Going on from interrupted runs on the simulated Spot: what is taken over, what is looked at, what is refused."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from spot_help import placed, robot, run_of

from recorders.spot.client.connection import Connection
from recorders.spot.client.errors import StillHolding
from recorders.spot.client.time_source import RunningClock
from recorders.spot.run.operator import StopSwitch
from recorders.spot.run.run import run_and_record
from recorders.spot.run.site_tasks import session_task
from recorders.spot.simulated.services.server import SimulatedSpot
from replayers.counterfactual.evidence import evidence_of
from replayers.counterfactual.replay import replay
from replayers.runs.resume_state import HasGaps, NothingToResume, OtherPlace, known_from_logs
from replayers.runs.run import Run, read
from workbench.cli import run as lios
from workbench.errors import BadValue
from workbench.execution.events import ActionEnded, Event
from workbench.log_schema.corrections import Correction, made_up_id
from workbench.log_schema.events import NANO, Stamp
from workbench.worlds.house import ContainerId, Item, ItemId, ItemType
from workbench.worlds.sites.site import load_site


def interrupted(
    spot: SimulatedSpot,
    connection: Connection,
    log: Path,
    when: Callable[[ActionEnded], bool],
    strategy: str = "conditioned-lios",
) -> Run:
    """A run that is stopped by key once an action for which `when` holds has ended."""
    stop = StopSwitch()

    def hear(event: Event) -> None:
        if isinstance(event, ActionEnded) and event.success and when(event):
            stop.press("stopped by key")

    report = run_and_record(connection, run_of(spot, strategy), log, stop=stop, on_event=hear)
    assert report.ended.status == "aborted"
    return read(log)


@pytest.mark.ci_but(1)
@pytest.mark.parametrize("strategy", ["pes-greedy", "conditioned-lios"])
def test_an_interrupted_task_goes_on_with_what_its_log_knows_and_replays_know_it_too(
    strategy: str, tmp_path: Path
) -> None:
    """The one strategy puts an item where it looked before; after the other, the robot looks there first."""
    site, _ = placed("C")
    with robot(configuration="C") as (spot, connection):
        log = tmp_path / "run.mcap"
        before = interrupted(spot, connection, log, lambda done: done.step.action == "place", strategy)
        earlier = known_from_logs([before], site.plan, site.travel)
        looked = {ContainerId(o.container) for o in before.observations}
        down = next(a for a in before.actions if a.action == "place")
        there = {**earlier.known, **earlier.put}[ContainerId(down.target)]
        assert down.items[0] in [item.id for item in there]
        assert set(earlier.known) == looked
        assert list(earlier.put) == ([down.target] if strategy == "conditioned-lios" else [])
        wanted = replace(run_of(spot, strategy, sees_m=0.0), earlier=earlier)
        report = run_and_record(connection, wanted, tmp_path / "on.mcap")
    assert report.ended.status == "done"
    after = read(tmp_path / "on.mcap")
    is_resumed = after.settings["spot"]["resumed"]
    assert after.info.origin_run == before.info.run_id
    assert (is_resumed["logs"][0]["sha256"], is_resumed["looked_first"]) == (before.sha256, list(earlier.put))
    known = {o.container for o in after.observations if o.known_at_start}
    assert known == looked | set(earlier.put)
    assert not known & {o.container for o in after.observations if not o.known_at_start}
    assert down.items not in {a.items for a in after.actions if a.action == "pick"}
    assert {str(c) for c in evidence_of(after).known} == known
    again = replay(after, strategy)
    assert again.bounds is not None
    assert again.bounds.exact
    assert again.bounds.lower == pytest.approx(report.ended.cost, rel=0.05), "the site's lengths for those walked"


def test_what_was_in_the_gripper_must_be_said_to_be_somewhere(tmp_path: Path) -> None:
    site, _ = placed()
    with robot() as (spot, connection):
        before = interrupted(spot, connection, tmp_path / "run.mcap", lambda done: done.step.action == "pick")
        item = next(a.items[0] for a in before.actions if a.action == "pick")
        with pytest.raises(BadValue, match=rf"--held-at is not given.*{item.split('|')[0]}"):
            known_from_logs([before], site.plan, site.travel)
        with pytest.raises(BadValue, match="attic"):
            known_from_logs([before], site.plan, site.travel, held_at="attic")
        earlier = known_from_logs([before], site.plan, site.travel, held_at="desk")
        everywhere = {**earlier.known, **earlier.put}
        assert item in [there.id for there in everywhere[ContainerId("desk")]]
        wanted = replace(run_of(spot, "pes-greedy"), earlier=earlier)
        assert spot.state.held is not None
        with pytest.raises(StillHolding, match="--held-at"):
            run_and_record(connection, wanted, tmp_path / "on.mcap")
        assert not (tmp_path / "on.mcap").exists()
        assert spot.state.leases.owner is None


@pytest.mark.ci
def test_sessions_of_one_home_are_joined_and_the_later_look_counts(tmp_path: Path) -> None:
    site, _ = placed()
    with robot() as (spot, connection):
        run = interrupted(spot, connection, tmp_path / "run.mcap", lambda done: done.step.action == "pick")
    seen = next(o for o in run.observations if o.items)
    unlooked = next(c.id for c in site.plan.containers if all(o.container != c.id for o in run.observations))
    elsewhere = msgspec.structs.replace(seen, container=unlooked)
    monday = replace(
        run,
        info=msgspec.structs.replace(
            run.info, run_id="monday", started=Stamp.of(run.info.started.ns - 86_400 * NANO)
        ),
        observations=(elsewhere,),
        actions=(),
        plans=(),
        beliefs=(),
        outcome=None,
        closed=False,
    )
    joined = known_from_logs([run, monday], site.plan, site.travel, held_at=unlooked)
    assert [one.run_id for one in joined.logs] == [run.info.run_id, "monday"]
    assert set(joined.known) == {o.container for o in run.observations} | {unlooked}
    held = next(a.items[0] for a in run.actions if a.action == "pick")
    assert [item.id for item in joined.known[ContainerId(unlooked)]] == [held]
    everything = [item.id for items in joined.known.values() for item in items]
    assert sorted(everything) == sorted(item.id for o in run.observations for item in o.items)


@pytest.mark.parametrize("of_the_type", [0, 1, 2])
def test_what_people_corrected_is_taken_over_and_told(of_the_type: int, tmp_path: Path) -> None:
    """Of an item that is named by its type, the tag is the only one that it may have; else the robot looks again."""
    site, _ = placed()
    with robot() as (spot, connection):
        run = interrupted(spot, connection, tmp_path / "run.mcap", lambda done: done.step.action == "search")
    place = run.observations[0].container
    spoon = ItemType("Spoon")
    correction = Correction(
        item=Item(id=made_up_id(spoon, ContainerId(place)), type=spoon),
        container=ContainerId(place),
        stamp_ns=run.observations[0].stamp.ns,
        author="Ada",
    )
    wrong = replace(correction, container=ContainerId("nowhere"))
    tagged = [Item(id=ItemId(f"Spoon|{n}"), type=spoon) for n in range(of_the_type)]
    items = (*site.tags.values(), *tagged)
    earlier = known_from_logs([replace(run, corrections=(correction, wrong))], site.plan, site.travel, items=items)
    there = [str(item.id) for item in earlier.known.get(ContainerId(place), ()) if item.type == spoon]
    assert there == [[f"Spoon|seen|{place}"], ["Spoon|0"], []][of_the_type]
    assert (ContainerId(place) in earlier.known) is (of_the_type < 2)
    assert earlier.notes[0].startswith("Ada says that Spoon")
    assert ("looked into again" in earlier.notes[0]) is (of_the_type == 2)
    assert earlier.notes[1].startswith("a correction is left out: ")
    assert "Ada says" in earlier.in_words()


def test_logs_that_cannot_be_gone_on_from_are_refused_in_one_line(tmp_path: Path) -> None:
    site, _ = placed()
    with robot() as (spot, connection):
        run = interrupted(spot, connection, tmp_path / "run.mcap", lambda done: done.step.action == "search")
    assert run.outcome is not None
    done = replace(run, outcome=msgspec.structs.replace(run.outcome, status="done"))
    fewer = replace(run.place.plan, containers=run.place.plan.containers[1:])
    elsewhere = replace(run, place=replace(run.place, plan=fewer))
    first = run.place.plan.containers[0]
    moved = replace(first, pose=replace(first.pose, x_m=first.pose.x_m + 1.0))
    shifted = replace(run.place.plan, containers=(moved, *run.place.plan.containers[1:]))
    gap = replace(run, actions=run.actions[1:], observations=run.observations)
    for log, error, said in (
        (done, NothingToResume, "is done"),
        (replace(run, task=session_task()), NothingToResume, "no task"),
        (elsewhere, OtherPlace, str(first.id)),
        (replace(run, place=replace(run.place, plan=shifted)), OtherPlace, "1.0 m away"),
        (gap, HasGaps, "missing"),
    ):
        with pytest.raises(error, match=said) as caught:
            known_from_logs([log], site.plan, site.travel)
        assert caught.value.exit_code == 2
        assert "\n" not in str(caught.value)
    with pytest.raises(BadValue, match="left out"):
        known_from_logs([run], site.plan, site.travel, held_at="desk")
    assert known_from_logs([replace(run, outcome=None, complete=False, closed=False)], site.plan, site.travel).known


def test_a_done_run_is_not_resumed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = Path(__file__).parents[3] / "logs" / "spot-home-A.mcap"
    options = ["--robot", "127.0.0.1:9", "--site", "paper_home", "-o", str(tmp_path / "on.mcap")]
    assert lios(["spot", "resume", str(log), *options]) == 2
    said = capsys.readouterr().err
    assert "its task is done" in said
    assert len(said.splitlines()) == 1


def test_a_detector_that_is_not_installed_is_named_before_the_robot_is_called(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    home = tmp_path / "home"
    shutil.copytree(load_site("paper_home").path.parent, home)
    site = home / "site.yaml"
    site.write_text(site.read_text() + "detector: {kind: opencv}\n")
    monkeypatch.setitem(sys.modules, "cv2", None)
    log = Path(__file__).parents[3] / "logs" / "spot-home-A.mcap"
    assert lios(["spot", "resume", str(log), "--robot", "127.0.0.1:9", "--site", str(site)]) == 2
    said = capsys.readouterr().err
    assert "lios-workbench[opencv]" in said
    assert len(said.splitlines()) == 1


@pytest.mark.slow
def test_the_command_writes_a_log_that_names_the_old_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("BOSDYN_CLIENT_USERNAME", "user")
    monkeypatch.setenv("BOSDYN_CLIENT_PASSWORD", "simulated")
    with robot(clock=RunningClock(speed_up=60)) as (spot, connection):
        log = tmp_path / "run.mcap"
        interrupted(spot, connection, log, lambda done: done.step.action == "search")
        there = spot.options(spot.write_certificate(tmp_path / "robot.pem"))
        options = ["--own-estop", "--furniture-open", "--look", "0.3", "--images-hz", "0"]
        assert lios(["spot", "resume", str(log), *there, "--dry-run"]) == 0
        assert "Plan 1 (start)" in capsys.readouterr().err
        assert lios(["spot", "resume", str(log), *there, *options]) == 0
        said = capsys.readouterr().err
        assert "Taken over from run.mcap: 1 container known" in said
        assert (
            lios(["spot", "resume", str(tmp_path / "run-resumed.mcap"), *there, "-o", str(tmp_path / "x.mcap")]) == 2
        )
        assert "its task is done" in capsys.readouterr().err
    assert lios(["info", str(tmp_path / "run-resumed.mcap")]) == 0
    assert f"of run {read(log).info.run_id}" in capsys.readouterr().out
    assert lios(["replay", str(tmp_path / "run-resumed.mcap"), "--strategies", "pes-greedy"]) == 0
    assert lios(["doctor", str(tmp_path / "run-resumed.mcap")]) == 0
