"""Solvers by name, as `--solver` and `STRATEGY@SOLVER` give them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from workbench.errors import MissingExtra, UnknownName, Unsupported
from workbench.planning.external import PddlCommand, UnifiedPlanning, engines_here
from workbench.planning.fast_downward import FastDownward
from workbench.planning.solver import BuiltIn, Solver

SOLVERS: Mapping[str, Callable[[], Solver]] = MappingProxyType(
    {
        "built-in": lambda: BuiltIn(),
        "sas-blind": lambda: FastDownward(search="blind"),
        "sas-lmcut": lambda: FastDownward(search="lmcut"),
        "sas-ff-astar2": lambda: FastDownward(search="ff-astar2"),
        "sas-anytime": lambda: FastDownward(search="anytime"),
        "pddl-blind": lambda: FastDownward(search="blind", route="pddl"),
        "pddl-lmcut": lambda: FastDownward(search="lmcut", route="pddl"),
        "pddl-ff-astar2": lambda: FastDownward(search="ff-astar2", route="pddl"),
        "pddl-anytime": lambda: FastDownward(search="anytime", route="pddl"),
    }
)
"""up-ENGINE is an engine of unified-planning; "command:..." a planner's command line."""

COMMAND = "command:"


class PlannerMissing(Unsupported):
    """A planner is not installed."""

    def __init__(self, name: str, why: str) -> None:
        super().__init__(f"solver {name}: {why}.")


def solver(name: str) -> Solver:
    """The solver of that name.

    A solver that is not installed reports this in the status of its plans.

    Raises:
        UnknownName: no such solver; lists the known ones.
        BadValue: a command line without {domain} or {problem}.
    """
    if name in SOLVERS:
        return SOLVERS[name]()
    if name.startswith("up-"):
        return UnifiedPlanning(engine=name[3:])
    if name.startswith(COMMAND):
        return PddlCommand(command=name[len(COMMAND) :])
    raise UnknownName("solver", name, (*SOLVERS, "up-ENGINE", "command:LINE"))


def installed_solver(name: str) -> Solver:
    """The solver of that name for a run; a missing installation is reported at once instead of as a table of
    failures.

    Raises:
        PlannerMissing: the planner is not installed.
        MissingExtra: unified-planning is not installed.
        UnknownName, BadValue: as for `solver`.
    """
    made = solver(name)
    if isinstance(made, PddlCommand) and made.program is None:
        raise PlannerMissing(name, "there is no such program. Install the planner, or give its path")
    if isinstance(made, UnifiedPlanning):
        here = engines_here()
        if here is None:
            raise MissingExtra(f"solver {name}", "planners")
        if made.engine not in here:
            raise PlannerMissing(name, f"unified-planning has no such engine here. It has {', '.join(here)}")
    return made
