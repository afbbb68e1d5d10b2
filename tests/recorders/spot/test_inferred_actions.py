"""Actions inferred from a driven robot's pose, tags and gripper."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from recorders.run_identity import Driver, run_info
from recorders.run_recorder import RunRecorder
from recorders.spot.run.site_tasks import delivery_of, place_of, site_task
from recorders.spot.session.inferred_actions import ActionDeriver
from recorders.spot.session.look_findings import LookFinding
from replayers.counterfactual.evidence import evidence_of
from replayers.doctor.examine import examine
from replayers.evaluation.detection_trials import detection_trials
from replayers.evaluation.perception import detection_rates
from replayers.runs.run import read
from workbench.execution.events import ActionEnded, ContainerObserved, Event, RunEnded
from workbench.log_schema.perception_json import perception_to_settings
from workbench.message_enum import Result
from workbench.search.costs import ROBOT_COSTS
from workbench.worlds.geometry import Point
from workbench.worlds.house import ContainerId, ItemType, LocationId
from workbench.worlds.perception import PERFECT, Perception
from workbench.worlds.sites.site import Site, load_site


@pytest.fixture(scope="module")
def home() -> Site:
    return load_site("paper_home")


class Trip:
    """Feeds a derivation with poses at 5 Hz."""

    def __init__(self, home: Site, perception: Perception = PERFECT) -> None:
        self.home, self.events, self.now_s, self.at = home, [], 0.0, (10.0, 2.4)
        self.derived = ActionDeriver(
            site=home,
            task=site_task(delivery_of(home), home),
            costs=ROBOT_COSTS,
            tell=self.events.append,
            perception=perception,
        )

    @property
    def looks(self) -> list[ContainerObserved]:
        return [event for event in self.events if isinstance(event, ContainerObserved)]

    @property
    def ns(self) -> int:
        return 10**18 + round(self.now_s * 1e9)

    def stand(self, seconds: float, tag: tuple[int, tuple[float, float, float]] | None = None) -> None:
        for _ in range(round(seconds * 5)):
            self.now_s += 0.2
            if tag is not None:
                self.derived.tag(self.ns, *tag)
            self.derived.pose(self.ns, self.at)

    def walk(self, place: str, *, beside_m: float = 0.0) -> None:
        pose = self.home.paths.standing_pose(LocationId(place))
        assert pose is not None
        pose = replace(pose, x_m=pose.x_m + beside_m)
        start, steps = self.at, 20
        for i in range(1, steps + 1):
            share = i / steps
            self.at = (start[0] + (pose.x_m - start[0]) * share, start[1] + (pose.y_m - start[1]) * share)
            self.now_s += 0.2
            self.derived.pose(self.ns, self.at)


def test_what_a_driven_robot_did_is_told_from_its_pose_tags_and_gripper(home: Site) -> None:
    trip = Trip(home)
    trip.stand(3)
    trip.walk("desk")
    trip.stand(5)
    trip.walk("couch")
    trip.stand(5, (102, (15.2, 4.3, 0.5)))
    trip.derived.holding(trip.ns, True)
    trip.stand(1)
    trip.walk("bed")
    trip.stand(3)
    trip.derived.holding(trip.ns, False)
    trip.stand(1, (102, (14.4, 0.95, 0.6)))
    ended = trip.derived.end()
    did = [(e.step.action, e.step.target) for e in trip.events if isinstance(e, ActionEnded)]
    assert did == [
        ("move", "desk"),
        ("search", "desk"),
        ("move", "couch"),
        ("search", "couch"),
        ("pick", "couch"),
        ("move", "bed"),
        ("search", "bed"),
        ("place", "bed"),
    ]
    seen = {e.container: [i.type for i in e.items] for e in trip.events if isinstance(e, ContainerObserved)}
    assert seen == {"desk": [], "couch": ["CellPhone"], "bed": []}, "what was carried here was not found here"
    assert ended.status == "aborted", "the bottle was not delivered"
    assert ended.searches == 3
    assert trip.derived.knowledge.items_at[LocationId("bed")][0].type == "CellPhone"
    stamps = [event.stamp_ns for event in trip.events if isinstance(event, Event)]
    assert stamps == sorted(stamps)
    assert isinstance(trip.events[-1], RunEnded)


def test_passing_by_is_no_look(home: Site) -> None:
    trip = Trip(home)
    trip.walk("couch")
    trip.walk("desk")
    trip.derived.end()
    assert not [e for e in trip.events if isinstance(e, ContainerObserved)]


def test_a_closed_container_that_nobody_opened_is_not_logged_as_empty(home: Site) -> None:
    closed = next(entry for entry in home.file.containers if entry.closed)

    def looked(trip: Trip) -> list[ContainerObserved]:
        return [event for event in trip.events if isinstance(event, ContainerObserved)]

    for said in (False, True):
        trip = Trip(home)
        trip.derived.closed_needs_word = True
        trip.walk(closed.id)
        trip.stand(3.0)
        if said:
            assert trip.derived.opened(trip.ns) == closed.id
        trip.stand(6.0)
        trip.derived.end()
        assert [event.container for event in looked(trip)] == ([closed.id] if said else [])
        assert [look.container for look in trip.derived.inconclusive] == ([] if said else [closed.id])
    seen = Trip(home)
    seen.derived.closed_needs_word = True
    seen.walk(closed.id)
    number = next(iter(home.tags))
    seen.stand(6.0, (number, (closed.pose.x_m, closed.pose.y_m, 1.0)))
    assert [event.items for event in looked(seen)] == [(home.tags[number],)], (
        "what is seen inside shows that it is open"
    )


PHONE = (102, (15.2, 4.3, 0.5))
"""The phone's tag, where it lies on the couch."""


def test_every_further_look_into_a_container_is_an_observation_of_its_own(home: Site) -> None:
    """Another visit, another viewpoint, and what shows only later; standing on from one viewpoint is none."""
    trip = Trip(home, Perception(p_detect=0.8, source="site", detector="robot"))
    trip.walk("couch")
    trip.stand(20)
    assert [len(look.items) for look in trip.looks] == [0], "one viewpoint, one look"
    trip.walk("couch", beside_m=0.4)
    trip.stand(6)
    assert [len(look.items) for look in trip.looks] == [0, 0]
    trip.walk("desk")
    trip.stand(5)
    trip.walk("couch")
    trip.stand(3)
    assert len(trip.looks) == 3, "a short stop is no look of its own"
    trip.stand(5)
    trip.stand(2, PHONE)
    trip.stand(9)
    ended = trip.derived.end()
    at_couch = [look for look in trip.looks if look.container == "couch"]
    assert [[item.type for item in look.items] for look in at_couch] == [[], [], [], ["CellPhone"]]
    made = [look.look for look in at_couch if look.look is not None]
    assert [look.number for look in made] == [1, 2, 3, 4]
    assert {p for look in made for _, p in look.p_detect} == {0.8}
    searched = [e for e in trip.events if isinstance(e, ActionEnded) and e.step.action == "search"]
    assert ended.searches == len(searched) == len(trip.looks) == 5
    stamps = [event.stamp_ns for event in trip.events]
    assert stamps == sorted(stamps)
    assert [i.type for i in trip.derived.knowledge.first_seen[ContainerId("couch")]] == ["CellPhone"]


def test_a_container_that_is_opened_is_looked_into_again(home: Site) -> None:
    trip = Trip(home)
    trip.walk("fridge")
    trip.stand(6)
    assert len(trip.looks) == 1
    trip.derived.opened(trip.ns)
    trip.stand(6)
    assert [look.container for look in trip.looks] == ["fridge", "fridge"]
    assert [look.opened_by for look in trip.looks] == ["", "operator"]


def test_passing_a_container_that_may_be_shut_again_takes_nothing_back(home: Site) -> None:
    closed = next(entry.id for entry in home.file.containers if entry.closed)
    trip = Trip(home)
    trip.derived.closed_needs_word = True
    trip.walk(closed)
    trip.stand(3)
    trip.derived.opened(trip.ns)
    trip.stand(6)
    trip.walk("desk")
    trip.stand(6)
    trip.walk(closed)
    trip.stand(6)
    assert [look.container for look in trip.looks] == [closed, "desk"]
    assert trip.derived.inconclusive == []


def test_doctor_replay_and_perception_count_every_look_of_a_session(home: Site, tmp_path: Path) -> None:
    """The phone on the couch is missed, then seen, then missed again."""
    trip = Trip(home, Perception(p_detect=0.8, source="site", detector="robot"))
    task = trip.derived.task
    with RunRecorder(
        tmp_path / "session.mcap",
        info=run_info(
            task,
            Driver(strategy="operator", estimator="counts"),
            id="0" * 12,
            place=home.name,
            started_ns=trip.ns,
            source="spot",
        ),
        place=place_of(home),
        task=task,
        costs=ROBOT_COSTS,
        settings=perception_to_settings(trip.derived.perception),
    ) as recorder:
        trip.derived.tell = recorder.record
        for shown in (None, PHONE, None):
            trip.walk("couch")
            trip.stand(6, shown)
            trip.walk("desk")
            trip.stand(6)
        trip.derived.end()
    run = read(tmp_path / "session.mcap")
    at_couch = [[item.type for item in o.items] for o in run.observations if o.container == "couch"]
    assert at_couch == [[], ["CellPhone"], []]
    assert [f for f in examine(run.path).findings if f.level in ("error", "warning")] == []
    evidence = evidence_of(run)
    assert [item.type for item in evidence.contents[ContainerId("couch")]] == ["CellPhone"]
    assert evidence.miss_chance[ItemType("CellPhone"), ContainerId("desk")] == pytest.approx(0.2), "one viewpoint"
    rates = {(r.by, r.group): r for r in detection_rates(detection_trials(run))}
    assert (rates["made", "look"].trials, rates["made", "look"].detected) == (1, 0), "the third look, which missed it"


class DoubtsCouch:
    """Finds every look into the couch inconclusive, as where a detection could not be placed."""

    def judge(self, at: LocationId, start_ns: int, end_ns: int, robot: Point) -> Result[LookFinding]:
        if at == "couch":
            return LookFinding.NOT_PLACED.result(reason="a frame that is nowhere")
        return LookFinding.SUPPORTED.result()


def _carried_from_couch(home: Site, *, seen_on_couch: bool, put_down_first: bool) -> Trip:
    """A phone goes from the couch, of which no look counts, to the bed."""
    trip = Trip(home)
    trip.derived.judge = DoubtsCouch()
    trip.walk("couch")
    trip.stand(5, (102, (15.2, 4.3, 0.5)) if seen_on_couch else None)
    trip.derived.holding(trip.ns, True)
    trip.stand(1)
    trip.walk("bed")
    on_bed = (102, (14.4, 0.95, 0.6))
    if not put_down_first:
        trip.stand(3, on_bed)
    trip.derived.holding(trip.ns, False)
    trip.stand(6, on_bed)
    trip.derived.end()
    return trip


@pytest.mark.parametrize("put_down_first", [False, True])
def test_what_is_picked_up_where_no_look_counts_is_found_neither_there_nor_where_it_is_put(
    home: Site, put_down_first: bool
) -> None:
    """Its tag was seen, so that the pick is told; the place where it was put down held nothing of it."""
    trip = _carried_from_couch(home, seen_on_couch=True, put_down_first=put_down_first)
    did = [(e.step.action, e.step.target, e.items) for e in trip.events if isinstance(e, ActionEnded)]
    phone = (home.tags[102].id,)
    assert [step for step in did if step[0] in ("pick", "place")] == [
        ("pick", "couch", phone),
        ("place", "bed", phone),
    ]
    seen = {e.container: e.items for e in trip.events if isinstance(e, ContainerObserved)}
    assert seen == {"bed": ()}
    assert [look.container for look in trip.derived.inconclusive] == ["couch"]


@pytest.mark.parametrize("put_down_first", [False, True])
def test_what_was_picked_up_unseen_makes_the_look_inconclusive_where_it_is_put_down(
    home: Site, put_down_first: bool
) -> None:
    """Nobody knows what was picked up: what stands on the bed afterwards may be it, and need not have stood there."""
    trip = _carried_from_couch(home, seen_on_couch=False, put_down_first=put_down_first)
    assert not [e for e in trip.events if isinstance(e, ContainerObserved)]
    assert [look.container for look in trip.derived.inconclusive] == ["couch", "bed"]
    assert trip.derived.inconclusive[-1].reason == LookFinding.MAY_BE_CARRIED.value
    trip.walk("desk")
    trip.stand(5)
    trip.walk("bed")
    trip.derived.holding(trip.ns, True)
    trip.stand(1)
    assert not [e for e in trip.events if isinstance(e, ActionEnded) and e.step.action == "pick"], (
        "picked up again, it did not stand on the bed at the start either"
    )
    assert [e.container for e in trip.events if isinstance(e, ContainerObserved)] == ["desk"]


def test_a_handle_that_is_grasped_and_let_go_leaves_the_look_as_it_is(home: Site) -> None:
    """What is held and let go during one visit came from nowhere else."""
    trip = Trip(home)
    trip.walk("couch")
    trip.stand(0.6)
    trip.derived.holding(trip.ns, True)
    trip.stand(0.6)
    trip.derived.holding(trip.ns, False)
    trip.stand(6, (102, (15.2, 4.3, 0.5)))
    trip.derived.end()
    seen = {e.container: e.items for e in trip.events if isinstance(e, ContainerObserved)}
    assert seen == {"couch": (home.tags[102],)}
    assert trip.derived.inconclusive == []
