"""Decisions of the runs in a tree, with what they were made by and what was done."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, final

from replayers.counterfactual.decisions.memoized_strategy import DecisionBasis
from workbench.planning.plans import PlanStep
from workbench.planning.strategy import Decision
from workbench.worlds.house import ContainerId
from workbench.worlds.knowledge import Knowledge


class Decided(Protocol):
    """One decision.

    Attributes:
        knowledge: what the robot knew; None where nobody knows by what was decided (a planner from outside).
        basis: what it was made by; None where nobody knows.
        made: what was decided.
        steps: what is done up to the look, or to the end of the plan.
        look: what is looked into then; the way there may be among the steps.
    """

    @property
    def knowledge(self) -> Knowledge | None: ...

    @property
    def basis(self) -> DecisionBasis | None: ...

    @property
    def made(self) -> Decision: ...

    @property
    def steps(self) -> tuple[PlanStep, ...]: ...

    @property
    def look(self) -> ContainerId | None: ...


@final
class Asked:
    """A decision that the strategy was asked for."""

    __slots__ = ("basis", "made")

    def __init__(self, basis: DecisionBasis | None, made: Decision) -> None:
        self.basis = basis
        self.made = made

    @property
    def knowledge(self) -> Knowledge | None:
        return None if self.basis is None else self.basis.view.knowledge

    @property
    def steps(self) -> tuple[PlanStep, ...]:
        if self.made.look_on_the_way:
            return ()
        steps = self.made.plan.steps[: self.made.steps_now]
        return steps[: next((i for i, step in enumerate(steps) if step.action == "find"), len(steps))]

    @property
    def look(self) -> ContainerId | None:
        made = self.made
        if made.look_on_the_way:
            return ContainerId(made.look_on_the_way[0])
        finds = any(step.action == "find" for step in made.plan.steps[: made.steps_now])
        return made.search_order[0].container if finds else None


@final
class Unasked:
    """A decision that was carried out without asking the strategy; it is asked when somebody wants to know.

    Args:
        ask: what the strategy decides, and by what.
        tell: what was done up to the look.
    """

    __slots__ = ("_answer", "_ask", "_tell", "knowledge", "look")

    def __init__(
        self,
        knowledge: Knowledge,
        look: ContainerId | None,
        *,
        ask: Callable[[], tuple[DecisionBasis | None, Decision]],
        tell: Callable[[], tuple[PlanStep, ...]],
    ) -> None:
        self.knowledge = knowledge
        self.look = look
        self._ask = ask
        self._tell = tell
        self._answer: tuple[DecisionBasis | None, Decision] | None = None

    @property
    def basis(self) -> DecisionBasis | None:
        return self._answered()[0]

    @property
    def made(self) -> Decision:
        return self._answered()[1]

    @property
    def steps(self) -> tuple[PlanStep, ...]:
        return self._tell()

    def _answered(self) -> tuple[DecisionBasis | None, Decision]:
        if self._answer is None:
            self._answer = self._ask()
        return self._answer
