"""Observations in passing: the open containers, and single items, that come into view on a move."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace

from workbench.execution.events import ContainerObserved, ItemSighted
from workbench.execution.further_looks import how_looked
from workbench.planning.tasks import Task
from workbench.worlds.house import ItemId, LocationId
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.perception import Perception
from workbench.worlds.travel import TravelCosts
from workbench.worlds.world import ActionDone, LookResult, NotInLog


def in_passing(
    answer: ActionDone, *, decision: int, before: Knowledge, perception: Perception, task: Task
) -> Iterator[ContainerObserved | ItemSighted]:
    """The observations made on a move, in the order in which containers and then single items came into view.

    Args:
        before: what the robot knew where the move began.
        perception: where looks can miss, so can one in passing, and the observation says how it was made.
    """
    for seen in answer.seen:
        yield ContainerObserved(
            stamp_ns=seen.stamp_ns,
            decision=decision,
            container=seen.container,
            items=seen.items,
            robot_at=before.robot_at,
            support=seen.support,
            look=how_looked(
                seen.container,
                before.looks(seen.container) + 1,
                perception=perception,
                task=task,
                viewpoint=seen.viewpoint,
            ),
            passing_from=seen.viewpoint,
        )
    for item in answer.items_seen:
        yield ItemSighted(
            stamp_ns=item.stamp_ns,
            decision=decision,
            container=item.container,
            item=item.item,
            robot_at=before.robot_at,
            viewpoint=item.viewpoint,
            support=item.support,
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
    for item in answer.items_seen:
        after = after.sighted(item.container, item.item)
    return after


def looked_into(knowledge: Knowledge, look: LookResult, sighted: Collection[ItemId]) -> Knowledge:
    """The knowledge after a look.

    Args:
        sighted: items that were seen in passing; a look knows better where they are.
    """
    for item in look.items:
        if item.id in sighted:
            knowledge = knowledge.without_item(item.id)
    return knowledge.seen(look.container, look.items)


def seen_in_words(answer: ActionDone) -> str:
    """Why the run decides again after a move."""
    items = (f"{seen.item.id} in {seen.container}" for seen in answer.items_seen)
    return f"saw {', '.join((*(seen.container for seen in answer.seen), *items))} in passing"


def unknown_in_words(answer: NotInLog, target: LocationId) -> str:
    """Why a log cannot answer."""
    if not answer.in_passing:
        return f"nobody opened {answer.container} while this was recorded"
    return f"nobody saw what is in {answer.container}, which comes into view on the way to {target}"
