"""A log as a world: what it answers, what it cannot answer, and the support of each answer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from toy import BED, COUNTER, DESK, FRIDGE, TABLE, item, toy_house
from toy_logs import Even, InOrder, toy_evidence, toy_run
from world_contract import check_world

from replayers.counterfactual.logged_world import LoggedWorld
from workbench.execution.events import ActionEnded, ContainerObserved, RunStatus
from workbench.execution.loop import outcome_of, run_task
from workbench.search.costs import SIMULATION_COSTS
from workbench.worlds.house import START, ItemId, LocationId
from workbench.worlds.world import ActionDone, ActionRefused, LookResult, NotInLog


def test_it_answers_what_was_seen_and_unseen_otherwise(tmp_path: Path) -> None:
    world = LoggedWorld(toy_run(tmp_path))
    assert set(world.known_at_start()) == {FRIDGE}
    went = world.go_to(COUNTER)
    assert isinstance(went, ActionDone)
    assert went.travel_m == 2.0
    looked = world.look_into(COUNTER)
    assert isinstance(looked, LookResult)
    assert item("Mug|1") in looked.items
    world.go_to(BED)
    assert world.look_into(BED) == NotInLog(start_ns=world.now_ns(), container=BED)


def test_with_a_filling_it_keeps_the_contract_of_every_world(tmp_path: Path) -> None:
    contents = toy_house().contents
    check_world(LoggedWorld(toy_run(tmp_path), filling=lambda c, _: contents[c]))


def test_every_answer_says_what_it_rests_on(tmp_path: Path) -> None:
    world = LoggedWorld(toy_run(tmp_path), filling=lambda c, _: (item("Cup|7"),))

    def support(answer: object) -> str:
        assert isinstance(answer, ActionDone | LookResult)
        return answer.support

    assert support(world.go_to(TABLE)) == "logged"
    assert support(world.look_into(TABLE)) == "logged"
    assert support(world.go_to(COUNTER)) == "logged"
    assert support(world.look_into(COUNTER)) == "logged"
    assert support(world.pick(item("Mug|1").id)) == "logged"
    assert support(world.place(item("Mug|1").id)) == "implied"
    assert support(world.go_to(BED)) == "implied"
    assert support(world.look_into(BED)) == "imputed"
    assert support(world.pick(item("Cup|7").id)) == "imputed"


def test_what_was_refused_while_recording_is_refused_again(tmp_path: Path) -> None:
    evidence = replace(
        toy_evidence(tmp_path),
        refused_searches=MappingProxyType({BED: "stuck door"}),
        refused_moves=MappingProxyType({DESK: "blocked"}),
        refused_picks=MappingProxyType({item("Mug|1").id: "slipped"}),
    )
    world = LoggedWorld(evidence)
    world.go_to(BED)
    assert world.look_into(BED) == ActionRefused(
        start_ns=world.now_ns() - 2 * 10**9, end_ns=world.now_ns(), reason="stuck door"
    )
    barred = world.go_to(DESK)
    assert isinstance(barred, ActionRefused)
    assert barred.reason == "blocked"
    world.go_to(COUNTER)
    world.look_into(COUNTER)
    assert isinstance(world.pick(item("Mug|1").id), ActionRefused)


def test_an_item_that_could_not_be_grasped_is_still_there(tmp_path: Path) -> None:
    mug = item("Mug|1")
    stuck = MappingProxyType({mug.id: "the gripper closed on nothing"})
    for left in (frozenset({mug.id}), frozenset[ItemId]()):
        world = LoggedWorld(replace(toy_evidence(tmp_path), refused_picks=stuck, left=left))
        world.go_to(COUNTER)
        world.look_into(COUNTER)
        refused = world.pick(mug.id)
        assert isinstance(refused, ActionRefused)
        assert refused.item_remains is bool(left)
        assert (mug in world.knowledge.items_at[LocationId(COUNTER)]) is bool(left)


def test_the_loop_over_a_log_ends_undetermined_at_the_container_that_nobody_opened(tmp_path: Path) -> None:
    evidence = toy_evidence(tmp_path)
    events = list(
        run_task(LoggedWorld(evidence), InOrder((TABLE, BED)), Even(), evidence.task, costs=SIMULATION_COSTS)
    )
    end = outcome_of(events)
    assert end.status is RunStatus.UNDETERMINED
    assert end.unseen == BED
    assert end.own_cost == 1.0 + 6.0
    assert [e.support for e in events if isinstance(e, ActionEnded | ContainerObserved) and e.support] == [
        "logged", "logged", "logged", "implied",
    ]  # fmt: skip


def test_what_is_put_into_a_container_shows_when_it_is_looked_into(tmp_path: Path) -> None:
    world = LoggedWorld(toy_run(tmp_path))
    for where in (COUNTER, TABLE):
        world.go_to(where)
        if where == COUNTER:
            world.look_into(COUNTER)
            world.pick(item("Mug|1").id)
    world.place(item("Mug|1").id)
    looked = world.look_into(TABLE)
    assert isinstance(looked, LookResult)
    assert {i.id for i in looked.items} == {"Plate|1", "Bread|1", "Bowl|1", "Mug|1"}
    world.go_to(COUNTER)
    again = world.look_into(COUNTER)
    assert isinstance(again, LookResult)
    assert "Mug|1" not in {i.id for i in again.items}
    assert world.knowledge.robot_at != START
