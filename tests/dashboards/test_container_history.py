"""One container of the toy run: contents and when, belief over time, costs of a look there, and picks by a ray."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import pytest
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, toy_plan
from toy_run import named_run, ns, other_run, toy_run

from dashboards.model.clock import Clock
from dashboards.model.containers.container_history import ContainerHistory, container_history
from dashboards.model.containers.container_pick import container_met
from dashboards.model.timeline import timeline_of
from dashboards.panels.container import container
from workbench.log_schema.events import SeenInPassing, SeenItem

INDEX = {c.id: i for i, c in enumerate(toy_plan().containers)}


def _history(which: str, second: float, **more: object) -> ContainerHistory:
    return container_history(timeline_of(toy_run()), INDEX[which], ns(second), focus="Mug", **more)  # type: ignore[arg-type]


def test_contents_are_told_from_the_moment_they_were_seen() -> None:
    before, after = _history(COUNTER, 6.9), _history(COUNTER, 7.0)
    assert before.contents is None
    assert before.searched_ns == ns(7)
    assert after.contents is not None
    assert [(c.item_type, c.count, c.wanted) for c in after.contents] == [("Mug", 1, True), ("Pot", 1, False)]


def test_an_item_that_was_picked_up_is_marked_from_then_on() -> None:
    for second, taken in ((11.9, 0), (12.0, 1)):
        contents = _history(COUNTER, second).contents
        assert contents is not None
        assert [c.taken for c in contents] == [taken, 0]


def test_a_container_known_at_the_start_has_contents_and_was_not_considered() -> None:
    history = _history(TABLE, 0)
    assert history.known
    assert history.contents is not None
    assert history.considerations == ()


def test_belief_over_time_is_that_of_the_decisions() -> None:
    assert _history(COUNTER, 0).belief == [(ns(0), 0.3), (ns(4), 0.3)]
    assert _history(FRIDGE, 15).belief == [(ns(0), 0.4)]


def test_decisions_tell_ranks_up_to_the_moment_the_last_first() -> None:
    assert [(c.number, c.rank, c.first) for c in _history(COUNTER, 15).considerations] == [
        (2, 1, COUNTER),
        (1, 2, FRIDGE),
    ]
    assert [c.number for c in _history(COUNTER, 3).considerations] == [1]
    assert [c.number for c in _history(FRIDGE, 15).considerations] == [1], "decided before it was searched"


def test_a_look_here_first_costs_what_the_find_costs_panel_says() -> None:
    first = _history(DESK, 1).considerations[0]
    assert first.rank == 3
    assert first.cost_here is not None
    assert first.cost_taken is not None
    assert first.cost_here > first.cost_taken


def test_truth_is_only_there_when_given() -> None:
    truth = {BED: (SeenItem("Book|1", "Book"),)}
    assert _history(BED, 15).truth is None
    given = _history(BED, 15, truth=truth).truth
    assert given is not None
    assert given[0].item_type == "Book"
    assert _history(DESK, 15, truth=truth).truth == ()


def test_way_and_room() -> None:
    history = _history(FRIDGE, 1)
    assert history.room == "Kitchen"
    assert history.distance_m == pytest.approx(timeline_of(toy_run()).run.place.travel.between("start", FRIDGE))  # type: ignore[arg-type]


def _panel(which: str, second: float, **more: object) -> str:
    clock = Clock(timelines=(timeline_of(toy_run()),))
    return container(_history(which, second, **more), clock, "Mug")


def test_the_panel_says_what_when_and_why() -> None:
    counter = _panel(COUNTER, 8)
    assert "Searched at" in counter
    assert "7.0 s" in counter
    assert "pot" in counter.lower()
    assert "<b>chosen</b>" in counter
    assert "more than" in _panel(DESK, 1)
    assert "this run never does" in _panel(BED, 15)
    assert "Ground truth" not in _panel(BED, 15)
    assert "Ground truth" in _panel(BED, 15, truth={})


def test_markup_in_names_is_shown_not_run() -> None:
    bad = "<img src=x onerror=alert(1)>"
    timeline = timeline_of(named_run(bad))
    truth = {FRIDGE: (SeenItem(bad, bad),)}
    history = container_history(timeline, INDEX[FRIDGE], ns(15), focus=bad, truth=truth)
    assert "<img" not in container(history, Clock(timelines=(timeline,)), bad)


def test_a_replay_that_ends_early_still_tells() -> None:
    history = container_history(timeline_of(other_run()), INDEX[BED], ns(9), focus="Mug")
    assert history.contents is None
    assert history.considerations[0].first == BED


@pytest.mark.parametrize("which", [FRIDGE, COUNTER, TABLE, BED, DESK])
def test_a_ray_from_above_meets_what_is_under_it(which: str) -> None:
    pose = toy_plan().containers[INDEX[which]].pose  # type: ignore[index]
    assert container_met(toy_plan(), (pose.x_m, pose.y_m, 9.0), (0, 0, -1)) == INDEX[which]  # type: ignore[index]


def test_a_ray_meets_the_nearest_and_an_empty_floor_meets_none() -> None:
    assert container_met(toy_plan(), (-3.0, 3.55, 0.5), (1, 0, 0)) == INDEX[FRIDGE]
    assert container_met(toy_plan(), (9.0, 3.55, 0.5), (1, 0, 0)) is None, "what is behind is not met"
    assert container_met(toy_plan(), (4.0, 2.0, 9.0), (0, 0, -1)) is None


def test_a_container_seen_in_passing_says_so_before_and_after() -> None:
    run = toy_run()
    seen = SeenInPassing(viewpoint=(1.0, 1.0, 0.0))
    passed = tuple(
        msgspec.structs.replace(o, passing=seen) if o.container == COUNTER else o for o in run.observations
    )
    timeline = timeline_of(replace(run, observations=passed))
    clock = Clock(timelines=(timeline,))
    shown = [
        str(container(container_history(timeline, INDEX[which], ns(second), focus="Mug"), clock, "Mug"))
        for which, second in ((COUNTER, 6.9), (COUNTER, 7.0), (FRIDGE, 15))
    ]
    assert "it is seen in passing at" in shown[0]
    assert "Seen in passing at" in shown[1]
    assert "Searched at" in shown[2]
