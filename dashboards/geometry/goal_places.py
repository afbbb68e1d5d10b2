"""Frames around the places that a task's goal names: containers, or a spot on the floor."""

from __future__ import annotations

from dashboards.geometry.marks import Mesh, goal_frame
from workbench.log_schema.place import Place
from workbench.planning.tasks import Task, goal_locations

SPOT_M = 0.6
"""Width of the frame around a place on the floor."""
FLOOR_M = 0.04


def goal_frames(place: Place, task: Task) -> tuple[Mesh, ...]:
    """One frame for each place of the goal, in order of their names; unknown places have none."""
    frames: list[Mesh] = []
    containers = {str(c.id): c for c in place.plan.containers}
    for location in goal_locations(task.goal):
        container = containers.get(str(location))
        if container is not None:
            wide, deep, high = container.size_m
            frames.append(goal_frame(container.pose, (wide, deep), container.base_m + high))
        elif location in place.standing:
            frames.append(goal_frame(place.standing[location], (SPOT_M, SPOT_M), FLOOR_M))
    return tuple(frames)
