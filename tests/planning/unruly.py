"""Strategies that violate the contract of strategies, for tests."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

from workbench.planning.actions import relevant_types
from workbench.planning.plans import Plan, PlanStatus
from workbench.planning.strategies import strategy
from workbench.planning.strategy import Decision, View
from workbench.planning.tasks import Task
from workbench.worlds.house import ItemType


class Fine:
    name = "fine"

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return relevant_types(task.goal)

    def decide(self, view: View) -> Any:
        return strategy("model-lios").decide(view)


class Raises(Fine):
    def decide(self, view: View) -> Any:
        raise RuntimeError("no\nidea")


class Exits(Fine):
    def decide(self, view: View) -> Any:
        sys.exit(0)


class AnswersNothing(Fine):
    def decide(self, view: View) -> Any:
        return None


class AnswersText(Fine):
    def decide(self, view: View) -> Any:
        return Decision(plan="find mug")  # type: ignore[arg-type]


class StepsOfText(Fine):
    def decide(self, view: View) -> Any:
        return Decision(plan=Plan(status=PlanStatus.SOLVED, steps=("go",)))  # type: ignore[arg-type]


class CostsNoNumber(Fine):
    def decide(self, view: View) -> Any:
        made = super().decide(view)
        return replace(made, plan=replace(made.plan, cost=float("nan")))


class NeverActs(Fine):
    def decide(self, view: View) -> Any:
        return replace(super().decide(view), steps_now=0)


class TypesRaise(Fine):
    def relevant_types(self, task: Task) -> Any:
        raise KeyError("types")


class TypesAreNothing(Fine):
    def relevant_types(self, task: Task) -> Any:
        return None


class NeverEnds(Fine):
    def decide(self, view: View) -> Any:
        while True:
            pass


class Prints(Fine):
    def decide(self, view: View) -> Any:
        print("thinking")
        return super().decide(view)


class CannotBeMade(Fine):
    def __init__(self) -> None:
        raise RuntimeError("no licence")


class WantsMore(Fine):
    def __init__(self, more: int) -> None: ...
