"""Observations in passing: the open containers that come into view on a move."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from workbench.execution.events import ContainerObserved
from workbench.worlds.house import LocationId
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.travel import TravelCosts
from workbench.worlds.world import ActionDone, NotInLog


def observed_in_passing(answer: ActionDone, *, decision: int, robot_at: LocationId) -> Iterator[ContainerObserved]:
    """The observations made on a move, in the order in which the containers came into view.

    Args:
        robot_at: where the move began.
    """
    for seen in answer.seen:
        yield ContainerObserved(
            stamp_ns=seen.stamp_ns,
            decision=decision,
            container=seen.container,
            items=seen.items,
            robot_at=robot_at,
            support=seen.support,
            passing_from=seen.viewpoint,
        )


def knowledge_after(
    knowledge: Knowledge, answer: ActionDone, *, robot_at: LocationId, travel: TravelCosts
) -> Knowledge:
    """The knowledge after a move on which containers came into view.

    Args:
        robot_at: where the move ended.
        travel: the travel costs from there.
    """
    after = replace(knowledge, travel=travel).moved(robot_at)
    for seen in answer.seen:
        after = after.seen(seen.container, seen.items)
    return after


def seen_in_words(answer: ActionDone) -> str:
    """Why the run decides again after a move."""
    return f"saw {', '.join(seen.container for seen in answer.seen)} in passing"


def unknown_in_words(answer: NotInLog, target: LocationId) -> str:
    """Why a log cannot answer."""
    if not answer.in_passing:
        return f"nobody opened {answer.container} while this was recorded"
    return f"nobody saw what is in {answer.container}, which comes into view on the way to {target}"
