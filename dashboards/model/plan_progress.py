"""Progress of the plan in force: each step as done, current or next."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from dashboards.model.labels import action_words
from dashboards.model.timeline import DecisionFrame
from workbench.log_schema.events import ActionFinished, Step

Progress = Literal["done", "current", "next"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedStep:
    """A step of the plan with its progress."""

    step: Step
    progress: Progress

    @property
    def words(self) -> str:
        """ "find mug, bring to start", "move to fridge 1", "pick egg at desk 1"."""
        return action_words(self.step.action, self.step.item_types, self.step.target)


def progress(frame: DecisionFrame, stamp_ns: int) -> tuple[PlannedStep, ...]:
    """The decision's steps at a moment.

    Actions that began before the moment are matched with steps in order: a step's own action ends it, while the
    moves and looks of a find keep the find current (it ends with a new decision).
    """
    if frame.plan is None:
        return ()
    done, current = 0, -1
    for action in frame.actions:
        if action.start.ns > stamp_ns:
            break
        at = _step_of(frame.plan.steps, done, action)
        if at is None:
            continue
        if action.stamp.ns <= stamp_ns and frame.plan.steps[at].action != "find":
            done, current = at + 1, -1
        else:
            current = at
    if current < 0 and done < len(frame.plan.steps):
        current = done
    return tuple(
        PlannedStep(step=step, progress="done" if i < done else "current" if i == current else "next")
        for i, step in enumerate(frame.plan.steps)
    )


def _step_of(steps: tuple[Step, ...], first: int, action: ActionFinished) -> int | None:
    """The first step from `first` on that an action belongs to: its own, or a find that looks and moves."""
    for i in range(first, len(steps)):
        step = steps[i]
        if step.action == action.action and step.target == action.target:
            return i
        if step.action == "find":
            return i if action.action in ("move", "search") else None
    return None
