"""The contract of every World, as checks that any test of a World can run."""

from __future__ import annotations

import pytest

from workbench.worlds.house import START, LocationId
from workbench.worlds.world import ActionDone, ActionRefused, LookResult, World


def check_world(world: World) -> None:
    """Walk to each of three containers, look, and take and put back one item. The robot stands at the start."""
    clock = world.now_ns()
    reached = [c.id for c in world.plan.containers if world.travel.reaches(LocationId(c.id))][:3]
    here = START
    for container in reached:
        place = LocationId(container)
        gone = world.go_to(place)
        assert isinstance(gone, ActionDone)
        assert gone.travel_m == pytest.approx(world.travel.between(here, place))
        assert clock <= gone.start_ns <= gone.end_ns == world.now_ns()
        here, clock = place, world.now_ns()
        looked = world.look_into(container)
        assert isinstance(looked, LookResult)
        assert looked.container == container
        assert looked.end_ns > clock
        if looked.items:
            item = looked.items[0].id
            assert isinstance(world.pick(item), ActionDone)
            assert isinstance(world.pick(item), ActionRefused)
            assert isinstance(world.place(item), ActionDone)
            again = world.look_into(container)
            assert isinstance(again, LookResult)
            assert {i.id for i in again.items} == {i.id for i in looked.items}
        clock = world.now_ns()
    for container in world.known_at_start():
        assert container in {c.id for c in world.plan.containers}
    assert isinstance(world.go_to(LocationId("nowhere at all")), ActionRefused)
