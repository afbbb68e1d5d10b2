"""The table of solvers by name, as `--solver` and `STRATEGY@SOLVER` give them, and a third party's by entry point.

A solver of your own is an entry point in the group "lios.solvers" whose value is a Solver, or a class or function
without arguments that makes one; or "module:Class" where a user gives a name (workbench/plugins.py).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.util import find_spec
from types import MappingProxyType
from typing import cast

from workbench.errors import MissingExtra, Unsupported
from workbench.planning.solvers.external import EngineUse, PddlCommand, UnifiedPlanning, engine_use, engines_here
from workbench.planning.solvers.fast_downward import FastDownward, downward_home
from workbench.planning.solvers.protocol import BuiltIn, Solver
from workbench.plugins import (
    SOLVER,
    NameOrigin,
    NotFromLog,
    Plugin,
    PluginNotLoaded,
    import_path,
    plugin,
    taken_name,
    tell_left_out,
)

SOLVERS: Mapping[str, Callable[[], Solver]] = MappingProxyType(
    {
        "built-in": lambda: BuiltIn(),
        "sas-blind": lambda: FastDownward(search="blind"),
        "sas-lmcut": lambda: FastDownward(search="lmcut"),
        "sas-ff-astar": lambda: FastDownward(search="ff-astar"),
        "sas-ff-astar2": lambda: FastDownward(search="ff-astar2"),
        "sas-anytime": lambda: FastDownward(search="anytime"),
        "pddl-blind": lambda: FastDownward(search="blind", route="pddl"),
        "pddl-lmcut": lambda: FastDownward(search="lmcut", route="pddl"),
        "pddl-ff-astar": lambda: FastDownward(search="ff-astar", route="pddl"),
        "pddl-ff-astar2": lambda: FastDownward(search="ff-astar2", route="pddl"),
        "pddl-anytime": lambda: FastDownward(search="anytime", route="pddl"),
    }
)
"""up-ENGINE is an engine of unified-planning; "command:..." a planner's command line."""

OURS = (BuiltIn, FastDownward, UnifiedPlanning, PddlCommand)
"""What a function that picks a solver may return under a name of ours."""

ENGINE = "up-"

COMMAND = "command:"


class PlannerMissing(Unsupported):
    """A planner is not installed."""

    def __init__(self, name: str, why: str) -> None:
        super().__init__(f"solver {name}: {why}.")


class EngineRefused(Unsupported):
    """An engine of unified-planning is installed and cannot do this job."""

    def __init__(self, name: str, why: str, others: tuple[str, ...]) -> None:
        super().__init__(f"solver {name}: {why}. Choose one of {', '.join(f'{ENGINE}{other}' for other in others)}.")


def solver(name: str, *, origin: NameOrigin = NameOrigin.LOG) -> Solver:
    """The solver of that name.

    One that is not installed says so by the status of its plans.

    Args:
        origin: who gives the name; command lines and "module:Class" are for users alone.

    Raises:
        UnknownName: no such solver; lists the known ones.
        NotFromLog: a name that only a user may give.
        PluginNotLoaded: a plug-in or "module:Class" that cannot be imported or made.
        BadValue: a command line without {domain} and {problem}.
    """
    found = solver_plugin(name, origin=origin)
    if found is not None:
        return _from_outside(found)
    if name in SOLVERS:
        return SOLVERS[name]()
    if name.startswith(ENGINE):
        return UnifiedPlanning(engine=name.removeprefix(ENGINE))
    return PddlCommand(command=name.removeprefix(COMMAND))


def solver_plugin(name: str, *, origin: NameOrigin) -> Plugin | None:
    """The plug-in of a solver's name; None for a built-in solver, an engine or a command line. Runs no code of it.

    Raises:
        UnknownName, NotFromLog: as solver.
    """
    if is_built_in(name):
        if origin is NameOrigin.USER:
            tell_left_out(SOLVER, name)
        elif name.startswith(COMMAND):
            raise NotFromLog(SOLVER, name)
        return None
    return plugin(SOLVER, name, origin=origin, known=(*SOLVERS, "up-ENGINE", "command:LINE", "module:Class"))


def is_built_in(name: str) -> bool:
    """Whether a name stands for a solver of the table, an engine of unified-planning or a command line."""
    return name in SOLVERS or name.startswith((ENGINE, COMMAND))


def solver_of_extra(name: str, *, origin: NameOrigin = NameOrigin.LOG) -> Solver:
    """The solver of that name, whose extra is installed.

    Raises:
        MissingExtra: Fast Downward or unified-planning is not installed.
        EngineRefused: an engine of unified-planning that is installed and cannot plan with costs.
        UnknownName, NotFromLog, PluginNotLoaded, BadValue: as solver.
    """
    made = solver(name, origin=origin)
    if isinstance(made, FastDownward) and downward_home() is None:
        raise MissingExtra(f"solver {name}", "planners")
    with import_path(origin):
        missing = isinstance(made, UnifiedPlanning) and find_spec("unified_planning") is None
    if missing:
        raise MissingExtra(f"solver {name}", "planners")
    if isinstance(made, UnifiedPlanning):
        with import_path(origin):
            use, here = engine_use(made.engine), engines_here() or ()
        if use is not EngineUse.OFFERED:
            raise EngineRefused(name, use.result().message, here)
    return made


def installed_solver(name: str, *, origin: NameOrigin = NameOrigin.LOG) -> Solver:
    """The solver of that name, for runs: one that is not installed raises at once, instead of failing every trial.

    Args:
        origin: who gives the name, as in solver.

    Raises:
        PlannerMissing: a planner that is not installed here.
        EngineRefused, MissingExtra, UnknownName, NotFromLog, PluginNotLoaded, BadValue: as solver_of_extra.
    """
    made = solver_of_extra(name, origin=origin)
    if isinstance(made, PddlCommand) and made.program is None:
        raise PlannerMissing(name, "there is no such program. Install the planner, or give its path")
    if isinstance(made, UnifiedPlanning):
        with import_path(origin):
            here = engines_here() or ()
        if made.engine not in here:
            raise PlannerMissing(name, f"unified-planning has no such engine here. It has {', '.join(here)}")
    return made


def _from_outside(found: Plugin) -> Solver:
    """A class or function without arguments that makes a solver, or a ready one."""
    try:
        with found.import_path():
            made = found.load()
            made = made() if isinstance(made, type) or (callable(made) and not _is_solver(made)) else made
    except (Exception, SystemExit) as error:
        raise PluginNotLoaded(SOLVER, found.name, f"{type(error).__name__}: {error}") from error
    if not _is_solver(made):
        raise PluginNotLoaded(
            SOLVER, found.name, f"it is {type(made).__name__}; a solver has name and solve(problem, budget_s=...)"
        )
    if is_built_in(cast(Solver, made).name) and not isinstance(made, OURS):
        raise PluginNotLoaded(SOLVER, found.name, taken_name(cast(Solver, made).name))
    return cast(Solver, made)


def _is_solver(thing: object) -> bool:
    return isinstance(getattr(thing, "name", None), str) and callable(getattr(thing, "solve", None))
