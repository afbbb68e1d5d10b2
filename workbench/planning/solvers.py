"""Which solvers are there? By name, as `--solver` and `STRATEGY@SOLVER` give them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from workbench.errors import UnknownName
from workbench.planning.external import PddlCommand, UnifiedPlanning
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


def solver(name: str) -> Solver:
    """The solver of that name.

    Raises:
        UnknownName: no such solver; lists the known ones.
        BadValue: a command line without {domain} and {problem}.
    """
    if name in SOLVERS:
        return SOLVERS[name]()
    if name.startswith("up-"):
        return UnifiedPlanning(engine=name[3:])
    if name.startswith(COMMAND):
        return PddlCommand(command=name[len(COMMAND) :])
    raise UnknownName("solver", name, (*SOLVERS, "up-ENGINE", "command:LINE"))
