"""What the operator wants by key during a run: pause and go on, skip a container, an item that is there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from spot_help import messages, placed, robot, run_of

from recorders.spot.client.clock import SteppedSessionClock
from recorders.spot.client.connection import Connection
from recorders.spot.run.operator_requests import SKIPPED, OperatorRequests, RunKeys
from recorders.spot.run.run import run_and_record
from recorders.spot.run.world import SpotWorld
from recorders.spot.session.session import Session
from recorders.spot.simulated.services.server import SimulatedSpot
from replayers.evaluation.detection_trials import LOOK, detection_trials
from replayers.runs.run import Run, read
from workbench.worlds.house import LocationId


def driven(
    spot: SimulatedSpot,
    connection: Connection,
    log: Path,
    monkeypatch: pytest.MonkeyPatch,
    press: Callable[[SpotWorld], None],
    **settings: float,
) -> tuple[str, Run]:
    """A run with these settings, during which `press` is called at every wait of the world."""
    real = SpotWorld.wait

    def wait(world: SpotWorld, seconds: float) -> None:
        if not world.ending:
            press(world)
        real(world, seconds)

    monkeypatch.setattr(SpotWorld, "wait", wait)
    report = run_and_record(connection, run_of(spot, "pes-greedy", **settings), log)
    return str(report.ended.status), read(log)


@pytest.mark.ci
def test_a_paused_robot_stands_and_walks_on_without_being_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stood: list[tuple[float, float]] = []

    with robot() as (spot, connection):
        assert isinstance(connection.clock, SteppedSessionClock)

        def press(world: SpotWorld) -> None:
            at = world.now_ns()
            if world.at is None and spot.state.body.walked_m > 1.0 and len(stood) < 20:
                world.requests.paused = True
                stood.append((spot.state.body.pose.x_m, at / 1e9))
            elif len(stood) >= 20:
                world.requests.paused = False

        status, run = driven(spot, connection, tmp_path / "run.mcap", monkeypatch, press)
    assert status == "done"
    assert stood[-1][1] - stood[2][1] > 5.0
    assert {x for x, _ in stood[3:]} == {stood[-1][0]}, "it stands"
    words = b" ".join(m[3] for m in messages(tmp_path / "run.mcap", "/log"))
    assert b"Paused by the operator" in words
    assert b"lets the robot go on" in words
    assert all(action.success for action in run.actions)


@pytest.mark.ci_but(1)
@pytest.mark.parametrize("while_looking", [False, True])
def test_a_skipped_container_is_refused_and_the_search_goes_on(
    while_looking: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    skipped: list[str] = []

    def press(world: SpotWorld) -> None:
        if not skipped and (world.at is not None) == while_looking:
            skipped.append(str(world.at))
            world.requests.skip()

    with robot() as (spot, connection):
        status, run = driven(spot, connection, tmp_path / "run.mcap", monkeypatch, press)
    assert status == "done"
    refused = [action for action in run.actions if not action.success]
    assert [(a.action, a.reason) for a in refused] == [("search" if while_looking else "move", SKIPPED)]
    assert refused[0].target not in {o.container for o in run.observations}


@pytest.mark.ci
def test_items_that_the_operator_sees_are_in_the_look_and_noted_and_not_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    items = tuple(item for _, item in sorted(placed()[0].tags.items()))
    told: list[str] = []

    def press(world: SpotWorld) -> None:
        if not told and world.at == LocationId("dining_table"):
            keys = RunKeys(world.requests, items, told.append)
            for key in "i1i2":
                keys.press(key)

    with robot("tag-not-seen@0") as (spot, connection):
        _, run = driven(spot, connection, tmp_path / "run.mcap", monkeypatch, press)
    look = next(o for o in run.observations if o.container == "dining_table")
    assert {item.id for item in look.items} == {item.id for item in items}
    assert told == [f"The operator says that {item.id} is here" for item in items]
    assert b"Correction: " in b" ".join(m[3] for m in messages(tmp_path / "run.mcap", "/log"))
    picks = [action for action in run.actions if action.action == "pick"]
    assert picks
    assert all(pick.item_remains for pick in picks), "what a person sees is there, though its tag is not seen"


@pytest.mark.ci
@pytest.mark.parametrize("detected", [pytest.param(True, marks=pytest.mark.slow), False])
def test_the_operators_word_is_no_detection(detected: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A look that shows an item only because the operator says so has missed it."""
    pressed: list[str] = []
    place, (item, *_) = next((name, items) for name, items in placed()[1].contents.items() if items)

    def press(world: SpotWorld) -> None:
        if not pressed and world.at == LocationId(place):
            pressed.append("i")
            session = getattr(world.tell, "__self__", None)
            assert isinstance(session, Session)
            RunKeys(world.requests, (item,), session.note).press("i")

    with robot(*(() if detected else ("tag-not-seen@0",))) as (spot, connection):
        _, run = driven(spot, connection, tmp_path / "run.mcap", monkeypatch, press, sees_m=0.0)
    (look,) = [o for o in run.observations if o.container == place]
    assert item.id in {shown.id for shown in look.items}
    here = [t for t in detection_trials(run, checked=True) if t.made == LOOK and t.item_type == item.type]
    assert [trial.detected for trial in here] == [detected]
    assert not any(trial.made == LOOK for trial in detection_trials(run)), "one look each tells nothing by itself"
    monkeypatch.setattr("replayers.evaluation.detection_trials.ASKED", frozenset[str]())
    left = [t for t in detection_trials(run, checked=True) if t.made == LOOK and t.item_type == item.type]
    assert left == [], "nobody asked for tags, so nobody can tell whether it was detected"


def test_keys_set_wishes_and_note_them() -> None:
    noted: list[str] = []
    requests, items = OperatorRequests(), tuple(placed()[0].tags.values())[:2]
    keys = RunKeys(requests, items, noted.append)
    for key in "npgkx":
        keys.press(key)
    assert noted[0] == "mark"
    assert len(noted) == 4
    assert not requests.paused
    assert requests.take_skip()
    assert not requests.take_skip()
    keys.press("i")
    keys.press("x")
    keys.press("2")
    assert requests.take_there() == (), "the choice was dropped"
    keys.press("i")
    keys.press("2")
    assert requests.take_there() == (items[1],)
    keys.press("k")
    requests.forget()
    assert not requests.take_skip()
