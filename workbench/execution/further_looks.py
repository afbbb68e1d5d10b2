"""Repeated looks: which searched containers may be looked into again, where looks can miss.

A strategy that plans with repeated looks (attribute `looks_again`) may choose at every decision any container that
was looked into fewer than MAX_LOOKS times; when all were, that many times once more. For all others, containers are
searched once first; when none is left and something is still missing, all are open again. Where the task says that
what is missing exists, that goes on for ever, else for MAX_LOOKS looks a container.
"""

from __future__ import annotations

from workbench.execution.events import LookMade
from workbench.planning.actions import relevant_types
from workbench.planning.strategy import Strategy
from workbench.planning.tasks import Task
from workbench.search.policy import SearchPolicy
from workbench.worlds.geometry import Pose
from workbench.worlds.house import ContainerId
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.perception import MAX_LOOKS, Perception

NS_PER_S = 1_000_000_000


def worth_another_look(
    knowledge: Knowledge, perception: Perception, task: Task, planner: Strategy | SearchPolicy
) -> frozenset[ContainerId]:
    """The searched containers that a planner may choose to look into again; those known at the start never are."""
    if perception.perfect:
        return frozenset()
    always = bool(getattr(planner, "looks_again", False))
    never_searched = set(knowledge.unsearched) - knowledge.again
    if not always and never_searched:
        return frozenset()
    if not always and knowledge.again.intersection(knowledge.unsearched):
        return knowledge.again  # this round is not over
    missing = [t for t in relevant_types(task.goal) if not knowledge.has_known_instance(t)]
    endless = any(t in task.available for t in missing)
    looked = dict.fromkeys(knowledge.visited)
    if not missing:
        return frozenset()
    if endless and not always:
        return frozenset(looked)
    least = 0 if never_searched else min((knowledge.looks(c) for c in looked), default=0)
    most = MAX_LOOKS * (1 + least // MAX_LOOKS) if endless else MAX_LOOKS
    return frozenset(c for c in looked if knowledge.looks(c) < most)


def how_looked(
    container: ContainerId,
    number: int,
    *,
    perception: Perception,
    task: Task,
    viewpoint: Pose | None,
    duration_ns: int = 0,
) -> LookMade | None:
    """How a look was made; None where looks show everything.

    Args:
        number: which look into this container it is, from 1.
        viewpoint: where the robot was; None where that is not known.
        duration_ns: 0 for a look in passing.
    """
    if perception.perfect:
        return None
    return LookMade(
        number=number,
        viewpoint=viewpoint,
        in_view=(container,),
        duration_s=duration_ns / NS_PER_S,
        detector=perception.detector,
        p_detect=tuple((t, perception.of(t)) for t in relevant_types(task.goal)),
        source=perception.source,
    )
