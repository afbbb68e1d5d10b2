"""A wrapper that runs a third-party strategy in this process and turns its faults into plan statuses.

An exception, an invalid decision, or a decision that exceeds the planning budget becomes a decision without a plan.
Whatever the strategy prints goes to standard error, since standard output carries the command's result. (Replays
isolate it further, in a separate process: replayers/counterfactual/sandbox.py.)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, cast, final

from workbench.debugging import show_traceback
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.strategy import Alternative, Decision, Strategy, View
from workbench.planning.tasks import Task
from workbench.search.find_costs import FindCosts, SearchStop
from workbench.third_party.calls import TimeLimitReached, exception_text, redirected_and_timed
from workbench.worlds.house import ItemType


@final
@dataclass(slots=True)
class GuardedStrategy:
    """A Strategy that never raises and never exceeds the planning budget.

    The time limit interrupts Python code in the main thread only; in other threads (a Dask worker) there is no
    limit.

    Attributes:
        strategy: the wrapped third-party strategy.
        fault: what went wrong when its relevant types were requested; it then makes no decisions.
    """

    strategy: Strategy
    fault: str | None = None

    @property
    def name(self) -> str:
        return self.strategy.name

    @property
    def looks_again(self) -> bool:
        """Whether the strategy says that it plans with repeated looks."""
        return getattr(self.strategy, "looks_again", False) is True

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        """The item types that the strategy wants beliefs about; empty if it fails to say."""
        self.fault = None
        try:
            with redirected_and_timed(task.budget_s):
                types: object = self.strategy.relevant_types(task)
        except TimeLimitReached:
            self.fault = f"it did not say within {task.budget_s:g} s which item types matter"
            return ()
        except (Exception, SystemExit) as error:  # noqa: BLE001  third-party code may raise anything
            show_traceback(error)
            self.fault = exception_text(error)
            return ()
        if not _all_isinstance(types, str):
            self.fault = f"its relevant_types are {_type_text(types)}, not a tuple of item types"
            return ()
        return tuple(sorted(cast("set[ItemType]", set(cast("tuple[Any, ...]", types)))))

    def decide(self, view: View) -> Decision:
        if self.fault is not None:
            return _without_plan(PlanStatus.SOLVER_FAILED, self.fault, self.name)
        try:
            with redirected_and_timed(view.budget_s):
                made: object = self.strategy.decide(view)
        except TimeLimitReached:
            why = f"{self.name} made no decision within the planning budget"
            return _without_plan(PlanStatus.TIMED_OUT, why, self.name)
        except (Exception, SystemExit) as error:  # noqa: BLE001  third-party code may raise anything
            show_traceback(error)
            return _without_plan(PlanStatus.SOLVER_FAILED, exception_text(error), self.name)
        return checked_decision(made, self.name)


def checked_decision(made: object, solver: str) -> Decision:
    """An answer if it is a decision that can be executed and recorded; else one without a plan that says why not."""
    if not isinstance(made, Decision):
        what = f"it returned {'nothing' if made is None else type(made).__name__} instead of a Decision"
        return _without_plan(PlanStatus.SOLVER_FAILED, what, solver)
    plan = made.plan
    if not _isinstance(plan, Plan):
        return _without_plan(PlanStatus.SOLVER_FAILED, f"its plan is {_type_text(plan)}, not a Plan", solver)
    wrong = next((what for what, fine in _checks(made, plan) if not fine), None)
    return made if wrong is None else _without_plan(PlanStatus.SOLVER_FAILED, f"its {wrong}", solver)


def _checks(made: Decision, plan: Plan) -> tuple[tuple[str, bool], ...]:
    """What can be wrong with the parts of a decision, and whether it is fine."""
    return (
        ("plan's status is no PlanStatus", _isinstance(plan.status, PlanStatus)),
        ("plan's steps are not a tuple of PlanStep", _all_isinstance(plan.steps, PlanStep)),
        ("plan's steps are not made of names and a cost", all(map(_is_valid_step, _each(plan.steps)))),
        ("plan's cost is not a finite number", _finite(plan.cost)),
        ("plan's lower_bound is not a finite number", plan.lower_bound is None or _finite(plan.lower_bound)),
        ("plan's optimal is neither True nor False", _isinstance(plan.optimal, bool)),
        ("plan's solver and note are not text", _isinstance(plan.solver, str) and _isinstance(plan.note, str)),
        ("find_costs are no FindCosts", made.find_costs is None or _isinstance(made.find_costs, FindCosts)),
        ("search_order is not a tuple of SearchStop", _all_isinstance(made.search_order, SearchStop)),
        ("alternatives are not a tuple of Alternative", _all_isinstance(made.alternatives, Alternative)),
        ("look_on_the_way is not a tuple of containers", _all_isinstance(made.look_on_the_way, str)),
    )


def _is_valid_step(step: object) -> bool:
    if not isinstance(step, PlanStep):
        return False
    words = all(_isinstance(word, str) for word in (step.action, step.origin, step.target))
    return words and _all_isinstance(step.item_types, str) and _all_isinstance(step.items, str) and _finite(step.cost)


def _isinstance(thing: object, kind: type) -> bool:
    """isinstance for values of third-party code, whose declared types cannot be trusted."""
    return isinstance(thing, kind)


def _each(things: object) -> tuple[object, ...]:
    return cast("tuple[object, ...]", things) if isinstance(things, tuple) else ()


def _all_isinstance(things: object, kind: type) -> bool:
    return isinstance(things, tuple) and all(isinstance(thing, kind) for thing in _each(things))


def _finite(number: object) -> bool:
    return isinstance(number, int | float) and math.isfinite(number)


def _type_text(thing: object) -> str:
    return "nothing" if thing is None else f"of type {type(thing).__name__}"


def _without_plan(status: PlanStatus, why: str, solver: str) -> Decision:
    return Decision(plan=Plan(status=status, note=why, solver=solver))
