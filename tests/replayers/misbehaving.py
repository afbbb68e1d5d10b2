"""Planners that break, stall, cheat or give invalid answers; and one that behaves."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from typing import Any

from toy import BED, COUNTER, TABLE
from toy_logs import InOrder

from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.strategy import Decision, View
from workbench.worlds.house import START, LocationId


class Behaves(InOrder):
    def __init__(self) -> None:
        super().__init__(order=(TABLE, COUNTER), name="behaves")


class Raises(Behaves):
    def decide(self, view: View) -> Decision:
        raise ValueError("no idea")


class RaisesLater(InOrder):
    """Breaks once it has seen the bed, which nobody opened."""

    def __init__(self) -> None:
        super().__init__(order=(TABLE, BED, COUNTER), name="raises-later")

    def decide(self, view: View) -> Decision:
        if BED not in view.knowledge.unsearched:
            raise ValueError("no idea of beds")
        return super().decide(view)


class HangsLater(RaisesLater):
    def decide(self, view: View) -> Decision:
        if BED not in view.knowledge.unsearched:
            time.sleep(60)
        return InOrder.decide(self, view)


class RaisesLines(Behaves):
    def decide(self, view: View) -> Decision:
        raise ValueError("first\n  second")


class Interrupts(Behaves):
    def decide(self, view: View) -> Decision:
        raise KeyboardInterrupt


class Prints(Behaves):
    def decide(self, view: View) -> Decision:
        print("what I think")
        os.write(1, b"what my library thinks\n")
        return super().decide(view)


class Hangs(Behaves):
    def decide(self, view: View) -> Decision:
        time.sleep(60)
        return super().decide(view)


class Dies(Behaves):
    def decide(self, view: View) -> Decision:
        os._exit(3)


class CostsNoNumber(Behaves):
    def decide(self, view: View) -> Decision:
        return Decision(plan=Plan(status=PlanStatus.SOLVED, steps=(), cost=float("nan")))


class AnswersNonsense(Behaves):
    def decide(self, view: View) -> Any:
        return "go left"


class Teleports(Behaves):
    def decide(self, view: View) -> Decision:
        step = PlanStep(action="move", origin=LocationId("the moon"), target=START)
        return Decision(plan=Plan(status=PlanStatus.SOLVED, steps=(step,)))


@dataclass(frozen=True)
class Peeks:
    house: Any
    name: str = "peeks"

    def __post_init__(self) -> None:
        print(self.house.contents)

    def relevant_types(self, task: Any) -> tuple[str, ...]:
        return ()

    def decide(self, view: View) -> Decision:
        raise NotImplementedError


def peeking(house: Any) -> Peeks:
    return Peeks(house)


NOT_A_STRATEGY = 3
