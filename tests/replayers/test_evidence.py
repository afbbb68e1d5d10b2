"""What a log makes certain: each odd case has the meaning that docs/replay.md gives it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from sample_logs import killed_toy_log
from toy import BED, COUNTER, DESK, FRIDGE, TABLE
from toy_logs import acted, seen, toy_run

from recorders.spot.run.site_tasks import session_task
from replayers.counterfactual.bounds.bounds import budget_of
from replayers.counterfactual.evidence import NoTaskAttempted, evidence_of
from replayers.counterfactual.evidence_rules import chances_of_missing
from replayers.counterfactual.replay import ReplaySettings, prepare_log, replay_strategy
from replayers.runs.contents import contents_at_start, picked_without_look
from replayers.runs.run import Run, read
from workbench.log_schema.events import ActionFinished, BeliefUpdate, HowLooked, Observation, Stamp
from workbench.planning.strategies import strategy
from workbench.worlds.house import ContainerId, ItemType

PLACES = (FRIDGE, COUNTER, TABLE, BED, DESK)


def ids(contents: dict[ContainerId, tuple], container: ContainerId) -> list[str]:
    return [item.id for item in contents[container]]


def test_searched_and_known_containers_are_certain_and_the_others_open(tmp_path: Path) -> None:
    evidence = evidence_of(toy_run(tmp_path))
    assert set(evidence.known) == {FRIDGE}
    assert set(evidence.contents) == {FRIDGE, TABLE, COUNTER}
    assert evidence.open == (BED, DESK)
    assert evidence.notes == ()


def test_a_session_without_a_task_is_refused(tmp_path: Path) -> None:
    """Its goal asks for nothing, which every planner has met before the first step."""
    run = toy_run(tmp_path)
    with pytest.raises(NoTaskAttempted, match="nothing to replay"):
        evidence_of(replace(run, task=session_task()))


def test_what_the_robot_put_down_is_not_counted_where_it_put_it() -> None:
    """The mug was taken from the counter to the bed; looking into the bed afterwards shows it there."""
    looks = [seen(COUNTER, "Mug|1", s=1), seen(BED, "Book|1", "Mug|1", s=9)]
    contents, notes = contents_at_start(looks, [acted("pick", COUNTER, "Mug|1", s=3)], PLACES)
    assert ids(contents, COUNTER) == ["Mug|1"]
    assert ids(contents, BED) == ["Book|1"]
    assert notes == ()


def test_an_item_seen_in_two_places_stands_where_it_was_seen_first() -> None:
    contents, notes = contents_at_start([seen(COUNTER, "Mug|1", s=1), seen(BED, "Mug|1", s=2)], [], PLACES)
    assert ids(contents, COUNTER) == ["Mug|1"]
    assert ids(contents, BED) == []
    assert len(notes) == 1
    assert "Mug|1 was seen in CounterTop|1 and in Bed|2" in notes[0]


def test_two_instances_of_a_type_are_two_items_and_one_listed_twice_is_one() -> None:
    contents, _ = contents_at_start([seen(COUNTER, "Mug|1", "Mug|2", "Mug|1", s=1)], [], PLACES)
    assert ids(contents, COUNTER) == ["Mug|1", "Mug|2"]


def test_what_only_a_later_look_shows_stood_there_from_the_start() -> None:
    looks = [seen(BED, "Book|1", s=1), seen(BED, "Pen|1", s=2), seen(BED, s=3)]
    contents, notes = contents_at_start(looks, [], PLACES)
    assert ids(contents, BED) == ["Book|1", "Pen|1"]
    assert notes == (f"Pen|1 was shown by a later look into {BED} only: earlier ones missed it",)


def test_what_was_put_down_between_two_looks_is_not_what_the_first_one_missed() -> None:
    looks = [seen(BED, s=1), seen(BED, "Mug|1", s=9)]
    contents, notes = contents_at_start(looks, [acted("place", BED, "Mug|1", s=3)], PLACES)
    assert (ids(contents, BED), notes) == ([], ())


@pytest.mark.parametrize(("apart_m", "left"), [(0.1, 0.2), (0.6, 0.04)])
def test_looks_from_one_viewpoint_of_a_robot_count_once(apart_m: float, left: float) -> None:
    looks = [
        msgspec.structs.replace(
            seen(BED, s=n),
            look=HowLooked(number=n, viewpoint=(n * apart_m, 0.0, 0.0), item_types=("Mug",), p_detect=(0.8,)),
        )
        for n in (1, 2)
    ]
    key = ItemType("Mug"), ContainerId(BED)
    assert chances_of_missing(looks, independent=False)[key] == pytest.approx(left)
    assert chances_of_missing(looks, independent=True)[key] == pytest.approx(0.04)


def test_a_container_that_the_place_does_not_have_is_left_out_with_a_note() -> None:
    contents, notes = contents_at_start([seen("Sofa|9", "Mug|1", s=1)], [], PLACES)
    assert contents == {}
    assert "Sofa|9" in notes[0]


def test_a_belief_over_a_container_that_is_not_there_is_left_out_with_a_note(tmp_path: Path) -> None:
    strange = BeliefUpdate(
        stamp=Stamp(1, 0), decision=1, item_types=("Mug",), containers=("Sofa|9", BED), probability=((0.5, 0.25),),
        estimator="x",
    )  # fmt: skip
    evidence = evidence_of(replace(toy_run(tmp_path), beliefs=(strange,)))
    assert dict(evidence.first_belief) == {("Mug", BED): 0.25}
    assert any("Sofa|9" in note for note in evidence.notes)


def test_beliefs_that_change_about_a_pair_are_not_steady(tmp_path: Path) -> None:
    def update(p: float) -> BeliefUpdate:
        return BeliefUpdate(
            stamp=Stamp(1, 0), decision=1, item_types=("Mug",), containers=(BED,), probability=((p,),), estimator="x"
        )

    run = toy_run(tmp_path)
    assert evidence_of(replace(run, beliefs=(update(0.5), update(0.5)))).static_beliefs
    assert not evidence_of(replace(run, beliefs=(update(0.5), update(0.6)))).static_beliefs


def test_what_was_refused_is_refused_again_unless_it_worked_later(tmp_path: Path) -> None:
    run = toy_run(tmp_path)
    more = (
        acted("search", BED, success=False, reason="stuck door"),
        acted("search", TABLE, success=False, reason="occluded"),
        acted("move", DESK, success=False, reason="blocked"),
        acted("pick", COUNTER, "Knife|1", success=False, reason="slipped"),
        acted("pick", COUNTER, "Mug|1", success=False, reason="slipped"),
    )
    evidence = evidence_of(replace(run, actions=run.actions + more))
    assert dict(evidence.refused_searches) == {BED: "stuck door"}
    assert dict(evidence.refused_moves) == {DESK: "blocked"}
    assert dict(evidence.refused_picks) == {"Knife|1": "slipped"}
    assert evidence.open == ()


def test_an_item_is_left_where_it_was_if_every_failed_pick_says_so(tmp_path: Path) -> None:
    run = toy_run(tmp_path)
    grasped = acted("pick", COUNTER, "Knife|1", success=False, reason="the gripper closed on nothing")
    grasp = msgspec.structs.replace(grasped, item_remains=True)
    gone = acted("pick", COUNTER, "Fork|1", success=False, reason="its tag is not seen")
    later = acted("pick", COUNTER, "Mug|1", success=False, reason="slipped")
    still, slipped = (msgspec.structs.replace(action, item_remains=True) for action in (gone, later))
    more = (grasp, grasp, gone, still, slipped)
    evidence = evidence_of(replace(run, actions=run.actions + more))
    assert evidence.left == {"Knife|1"}
    assert set(evidence.refused_picks) == {"Knife|1", "Fork|1"}


@pytest.mark.parametrize("events", [9, 12])
def test_a_log_that_is_cut_off_says_so_and_gives_what_it_holds(tmp_path: Path, events: int) -> None:
    run = read(killed_toy_log(tmp_path / "killed.mcap", events=events))
    evidence = evidence_of(run)
    assert not evidence.complete
    assert any("cut off" in note for note in evidence.notes)
    assert FRIDGE in evidence.contents


def _picked(target: str, item: str, s: int) -> ActionFinished:
    return msgspec.structs.replace(acted("pick", target, item, s=s), item_types=(item.partition("|")[0],))


@pytest.mark.parametrize(
    ("looks", "actions", "stood"),
    [
        ([], [_picked(COUNTER, "Mug|1", 3)], {COUNTER: ["Mug|1"]}),
        ([seen(COUNTER, "Pan|1", s=9)], [_picked(COUNTER, "Mug|1", 3)], {COUNTER: ["Mug|1"]}),
        ([seen(COUNTER, "Mug|1", s=1)], [_picked(COUNTER, "Mug|1", 3)], {}),
        ([seen(BED, "Mug|1", s=1)], [_picked(COUNTER, "Mug|1", 3)], {}),
        ([], [acted("place", COUNTER, "Mug|1", s=2), _picked(COUNTER, "Mug|1", 3)], {}),
        ([], [_picked("Start", "Mug|1", 3)], {}),
    ],
    ids=["no look", "look after", "look before", "seen elsewhere", "put there by the robot", "no container"],
)
def test_what_was_picked_up_where_no_look_counts_stood_there_unless_it_was_moved(
    looks: list[Observation], actions: list[ActionFinished], stood: dict[str, list[str]]
) -> None:
    found = picked_without_look(looks, actions, PLACES)
    assert {container: [item.id for item in items] for container, items in found.items()} == stood


def _without_look(run: Run, container: str) -> Run:
    """The run as an import whose look into a container was inconclusive: no search, no observation."""
    assert run.outcome is not None
    kept = [a for a in run.actions if not (a.action == "search" and a.target == container)]
    return replace(
        run,
        info=msgspec.structs.replace(run.info, source="import"),
        actions=tuple(msgspec.structs.replace(a, index=i + 1) for i, a in enumerate(kept)),
        observations=tuple(o for o in run.observations if o.container != container),
        outcome=msgspec.structs.replace(run.outcome, searches=run.outcome.searches - 1),
    )


def test_a_pick_where_no_look_counts_leaves_the_rest_of_the_container_open() -> None:
    """It is no gap in the log, every world has the item there, and the bounds hold those of the log with the look."""
    run = read(Path(__file__).parents[2] / "logs" / "deliver-3.mcap")
    whole = evidence_of(run)
    for container, item in (("TVStand|2|2", "Suitcase|2|24"), ("Toilet|6|0", "Lighter|6|7")):
        torn = _without_look(run, container)
        evidence = evidence_of(torn)
        assert evidence.gaps.lost == ()
        assert {c: [i.id for i in items] for c, items in evidence.partly.items()} == {container: [item]}
        assert set(evidence.open) == {*whole.open, container}
        assert item.partition("|")[0] in evidence.seen_types()
        assert any(item in note and container in note for note in evidence.notes)
        settings = ReplaySettings(worlds=20, budget=budget_of(100))
        prepared, true = prepare_log(torn, settings), prepare_log(run, settings)
        for name in ("opt-greedy", "pes-lios"):
            loose, tight = (replay_strategy(one, strategy(name)).bounds for one in (prepared, true))
            assert loose is not None
            assert tight is not None
            assert loose.lower <= tight.least_found
            assert tight.largest_found <= loose.upper


def test_a_pick_without_a_look_of_a_simulated_run_is_a_gap() -> None:
    run = read(Path(__file__).parents[2] / "logs" / "deliver-3.mcap")
    torn = _without_look(run, "TVStand|2|2")
    torn = replace(torn, info=run.info)
    evidence = evidence_of(torn)
    assert "TVStand|2|2" in evidence.gaps.not_looked
    assert evidence.partly == {}
