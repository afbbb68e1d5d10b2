"""A strategy of one's own: search the room at hand before the next one, whatever the belief says."""

from __future__ import annotations

from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.strategy import Decision, View
from workbench.planning.tasks import Holding, Task, goal_types
from workbench.search.find_costs import SearchStop
from workbench.worlds.house import ItemType, LocationId


class RoomsFirst:
    """Finds one item type and brings it to a place: nearest container of the nearest room first."""

    name = "rooms-first"

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return goal_types(task.goal)

    def decide(self, view: View) -> Decision:
        goal, known = view.task.goal, view.knowledge
        if not isinstance(goal, Holding):
            return Decision(plan=Plan(status=PlanStatus.NO_PLAN, note="rooms-first only finds single items"))
        here = known.robot_at
        if known.holding is not None:
            return self._plan(PlanStep(action="move", origin=here, target=goal.at))
        for place, item in known.where(goal.item_type):
            walk = [PlanStep(action="move", origin=here, target=place)] if place != here else []
            return self._plan(*walk, PlanStep(action="pick", origin=place, target=place, items=(item.id,)))
        order = sorted(known.unsearched, key=lambda c: (self._room_is_elsewhere(view, c), self._metres(view, c)))
        if not order:
            return Decision(plan=Plan(status=PlanStatus.NO_PLAN, note="every container is searched"))
        find = PlanStep(action="find", origin=here, target=goal.at, item_types=(goal.item_type,))
        stop = SearchStop(container=order[0], probability=0.0, reached=1.0, leg_m=self._metres(view, order[0]))
        return Decision(plan=Plan(status=PlanStatus.SOLVED, steps=(find,)), search_order=(stop,))

    def _plan(self, *steps: PlanStep) -> Decision:
        return Decision(plan=Plan(status=PlanStatus.SOLVED, steps=steps))

    def _metres(self, view: View, place: str) -> float:
        return view.knowledge.travel.between(view.knowledge.robot_at, LocationId(place)) or 0.0

    def _room_is_elsewhere(self, view: View, place: str) -> bool:
        rooms = {LocationId(c.id): c.room for c in view.knowledge.plan.containers}
        return rooms[LocationId(place)] != rooms.get(view.knowledge.robot_at)
