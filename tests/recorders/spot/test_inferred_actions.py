"""Actions inferred from a driven robot's pose, tags and gripper."""

from __future__ import annotations

import pytest

from recorders.spot.run.site_tasks import delivery_of, site_task
from recorders.spot.session.inferred_actions import ActionDeriver
from workbench.execution.events import ActionEnded, ContainerObserved, Event, RunEnded
from workbench.search.costs import ROBOT_COSTS
from workbench.worlds.house import LocationId
from workbench.worlds.sites.site import Site, load_site


@pytest.fixture(scope="module")
def home() -> Site:
    return load_site("paper_home")


class Trip:
    """Feeds a derivation with poses at 5 Hz."""

    def __init__(self, home: Site) -> None:
        self.home, self.events, self.now_s, self.at = home, [], 0.0, (10.0, 2.4)
        self.derived = ActionDeriver(
            site=home, task=site_task(delivery_of(home), home), costs=ROBOT_COSTS, tell=self.events.append
        )

    @property
    def ns(self) -> int:
        return 10**18 + round(self.now_s * 1e9)

    def stand(self, seconds: float, tag: tuple[int, tuple[float, float, float]] | None = None) -> None:
        for _ in range(round(seconds * 5)):
            self.now_s += 0.2
            if tag is not None:
                self.derived.tag(self.ns, *tag)
            self.derived.pose(self.ns, self.at)

    def walk(self, place: str) -> None:
        pose = self.home.paths.standing_pose(LocationId(place))
        assert pose is not None
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
