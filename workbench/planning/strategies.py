"""The table of strategies by name, and a third party's by entry point or `module:Class`.

The paper's five are find cost + search policy, by its definitions and its candidates; the oracle knows the house;
conditioned-lios and scout-lios are ours. A strategy of your own is an entry point in the group "lios.strategies"
whose value is a StrategyFactory, or "module:Class" where a user gives a name (workbench/plugins.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TypeVar, cast

from workbench.caches import Cache
from workbench.errors import BadValue, Unsupported
from workbench.planning.composed import Composed
from workbench.planning.find_pricing import Expected, Optimistic, Pessimistic, WholeSearch, WithRepeatedLooks
from workbench.planning.guarded_strategy import GuardedStrategy
from workbench.planning.oracle import Oracle
from workbench.planning.rollouts.scout import Scout
from workbench.planning.strategy import Strategy, StrategyFactory
from workbench.plugins import (
    STRATEGY,
    NameOrigin,
    Plugin,
    PluginNotLoaded,
    import_path,
    installed_names,
    plugin,
    taken_name,
    tell_left_out,
)
from workbench.search.policies.registry import policy
from workbench.third_party.calls import LOADING_S, TimeLimitReached, redirected_and_timed
from workbench.worlds.house import House

Plans = TypeVar("Plans", Composed, Oracle)


class OracleNeedsHouse(Unsupported):
    """The oracle was requested where no true house is available."""

    def __init__(self) -> None:
        super().__init__("the oracle knows the house, and no house is given here. Choose another strategy.")


class StrategyNotLoaded(PluginNotLoaded):
    """A plug-in or "module:Class" that does not yield a strategy.

    Args:
        name: the requested name.
        why: what went wrong, without a full stop.
    """

    def __init__(self, name: str, why: str) -> None:
        super().__init__(STRATEGY, name, why)


def _oracle(house: House | None) -> Strategy:
    if house is None:
        raise OracleNeedsHouse()
    return Oracle(house=house)


def _model(name: str, *, per_find: bool) -> Composed:
    return Composed(name=name, pricing=Expected(per_find=per_find), policy=policy("lios"))


def _conditioned(name: str, *, per_find: bool = False) -> Composed:
    pricing = Expected(belief_model="exists", per_find=per_find)
    return Composed(name=name, pricing=pricing, policy=policy("conditioned-lios"))


def _robust(name: str) -> Composed:
    """conditioned-lios where looks can miss: it plans with repeated looks."""
    return Composed(name=name, pricing=WithRepeatedLooks(), policy=policy(name), looks_again=True)


def _whole_search(name: str) -> Composed:
    """A strategy with find costs that count the whole search under the `marginal` belief, and the policy of that
    name."""
    return Composed(name=name, pricing=WholeSearch(), policy=policy(name))


STRATEGIES: Mapping[str, StrategyFactory] = MappingProxyType(
    {
        "opt-greedy": lambda _: Composed(name="opt-greedy", pricing=Optimistic(), policy=policy("greedy")),
        "pes-greedy": lambda _: Composed(name="pes-greedy", pricing=Pessimistic(), policy=policy("greedy")),
        "opt-lios": lambda _: Composed(name="opt-lios", pricing=Optimistic(), policy=policy("lios")),
        "pes-lios": lambda _: Composed(name="pes-lios", pricing=Pessimistic(), policy=policy("lios")),
        "model-lios": lambda _: _model("model-lios", per_find=False),
        "conditioned-lios": lambda _: _conditioned("conditioned-lios"),
        "scout-lios": lambda _: Scout(base=_whole_search("full-lios"), cooking=_conditioned("conditioned-lios")),
        "oracle": _oracle,
    }
)
"""In the order of the tables: the paper's five, ours, the oracle."""

VARIANTS: Mapping[str, StrategyFactory] = MappingProxyType(
    {
        "marginal-lios": lambda _: _whole_search("marginal-lios"),
        "full-lios": lambda _: _whole_search("full-lios"),
        "most-probable": lambda _: Composed(
            name="most-probable", pricing=Expected(belief_model="marginal"), policy=policy("most-probable")
        ),
        "model-lios-per-find": lambda _: _model("model-lios-per-find", per_find=True),
        "conditioned-lios-per-find": lambda _: _conditioned("conditioned-lios-per-find", per_find=True),
        "robust-lios": lambda _: _robust("robust-lios"),
        "sight-lios": lambda _: Composed(
            name="sight-lios", pricing=Expected(belief_model="exists"), policy=policy("sight-lios")
        ),
    }
)
"""Selectable by name, not part of "all": ablations of our strategies, a baseline of the search experiment, and
robust-lios and sight-lios, which differ from conditioned-lios only where looks can miss and where the robot sees in
passing."""

EVERYWHERE = "everywhere"
"""STRATEGY@everywhere plans over all locations and states the proven gap with each plan; STRATEGY@everywhere-SOLVER
gives that solver all locations and known items, as a planner without pruning has them."""

NEEDS_TRUTH = ("oracle",)

ALIASES: Mapping[str, str] = MappingProxyType(
    {
        "greedy": "opt-greedy",
        "lios": "model-lios",
        **{
            f"workbench.evaluation.search_strategies:{name.replace('-', '_')}": name
            for name in ("most-probable", "marginal-lios", "full-lios")
        },
    }
)
"""Short names, and the names under which early logs of `lios evaluate search --record` name these strategies."""

PAPER_NAMES: Mapping[str, str] = MappingProxyType(
    {
        "opt-greedy": "OptGreedy",
        "pes-greedy": "PesGreedy",
        "opt-lios": "OptLIOS",
        "pes-lios": "PesLIOS",
        "model-lios": "ModelLIOS",
        "conditioned-lios": "ConditionedLIOS",
        "scout-lios": "ScoutLIOS",
        "marginal-lios": "MarginalLIOS",
        "full-lios": "FullLIOS",
        "most-probable": "MostProbable",
        "model-lios-per-find": "ModelLIOS-per-find",
        "conditioned-lios-per-find": "ConditionedLIOS-per-find",
        "robust-lios": "RobustLIOS",
        "sight-lios": "SightLIOS",
        "oracle": "Oracle",
    }
)
"""The spelling in tables and figures."""


def strategy(name: str, *, origin: NameOrigin = NameOrigin.LOG, house: House | None = None) -> Strategy:
    """The strategy of that name, alias, paper's spelling, installed plug-in, or "module:Class"; STRATEGY@SOLVER too.

    Args:
        origin: who gives the name; "module:Class" and solvers by command line are for users alone.
        house: the truth, for the oracle alone; no other built-in looks at it.

    Raises:
        UnknownName: no such strategy or solver; lists the known ones.
        NotFromLog: a name that only a user may give.
        StrategyNotLoaded: a plug-in or "module:Class" that cannot be imported or made.
        OracleNeedsHouse: the oracle without a house.
    """
    base, at, solver_name = name.partition("@")
    if at and canonical_name(base) is not None:
        return _with_solver(strategy(base, origin=origin, house=house), solver_name, origin)
    known = canonical_name(name)
    if known is not None and origin is NameOrigin.USER:
        tell_left_out(STRATEGY, name)
    if known in NEEDS_TRUTH:
        return _built_in(known, origin, house)
    if known is not None:
        return _MADE.get(known, lambda: _built_in(known, origin, None))
    return _plugin_strategy(strategy_plugin(name, origin=origin))


_MADE: Cache[str, Strategy] = Cache(64)
"""Built-in strategies, which nobody can change, by canonical name."""


def _built_in(known: str, origin: NameOrigin, house: House | None) -> Strategy:
    make = STRATEGIES.get(known) or VARIANTS[known]
    with import_path(origin):
        return make(house)


def strategy_plugin(name: str, *, origin: NameOrigin) -> Plugin:
    """The plug-in of a name that is in neither table. Runs none of its code.

    Raises:
        UnknownName, NotFromLog: as strategy.
    """
    return plugin(
        STRATEGY, name, origin=origin, known=(*STRATEGIES, *VARIANTS, *(a for a in ALIASES if ":" not in a))
    )


def _with_solver(made: Strategy, solver_name: str, origin: NameOrigin) -> Strategy:
    """The strategy with another solver: "model-lios@pddl-ff-astar2" plans as the paper does.

    Raises:
        UnknownName, NotFromLog: no such solver, or none that a log may name.
        BadValue: a strategy that takes none.
    """
    name = f"{made.name}@{solver_name}"
    if isinstance(made, Composed):
        return replace(_with_planner(made, solver_name, origin), name=name)
    if isinstance(made, Oracle):
        return replace(_with_planner(made, solver_name, origin), name=name)
    if isinstance(made, Scout):
        base, cooking = (_with_planner(part, solver_name, origin) for part in (made.base, made.cooking))
        return replace(made, name=name, base=base, cooking=cooking)
    raise BadValue("strategy with a solver", name, "a built-in strategy")


def _with_planner(part: Plans, solver_name: str, origin: NameOrigin) -> Plans:
    """The planning component with that solver, or over all locations."""
    from workbench.planning.solvers.registry import installed_solver

    if solver_name == EVERYWHERE:
        return replace(part, everywhere=True)
    if not solver_name.startswith(f"{EVERYWHERE}-"):
        return replace(part, solver=installed_solver(solver_name, origin=origin))
    if not isinstance(part, Composed):
        raise BadValue("strategy without pruning", f"{part.name}@{solver_name}", "one that finds items by searching")
    return replace(part, everywhere=True, solver=installed_solver(solver_in(f"@{solver_name}"), origin=origin))


def solver_in(name: str) -> str:
    """The solver's name in STRATEGY@SOLVER or STRATEGY@everywhere-SOLVER; empty where it is the built-in one."""
    solver_name = name.partition("@")[2]
    return "" if solver_name == EVERYWHERE else solver_name.removeprefix(f"{EVERYWHERE}-")


def canonical_name(name: str) -> str | None:
    """The canonical name for a name, an alias or the paper's spelling; None if it is not in the table."""
    wanted = name.strip().lower()
    wanted = ALIASES.get(wanted, wanted)
    if wanted in STRATEGIES or wanted in VARIANTS:
        return wanted
    return next((ours for ours, paper in PAPER_NAMES.items() if paper.lower() == wanted), None)


def is_built_in(name: str) -> bool:
    """Whether a name, alias or the paper's spelling, with any solver, stands for a strategy of the table."""
    return canonical_name(name.partition("@")[0]) is not None


def needs_truth(name: str) -> bool:
    """Whether a strategy, with any solver, needs the true house."""
    return canonical_name(name.partition("@")[0]) in NEEDS_TRUTH


def resolved_name(name: str) -> str:
    """The name used in logs and tables: canonical for aliases and the paper's spellings, otherwise unchanged."""
    base, at, solver_name = name.partition("@")
    return f"{canonical_name(base) or base}{at}{solver_name}"


def strategy_names(*, with_truth: bool) -> tuple[str, ...]:
    """All strategy names: the table in its order, then installed plug-ins, sorted.

    Args:
        with_truth: whether to include strategies that need the true house.
    """
    ours = tuple(name for name in STRATEGIES if with_truth or name not in NEEDS_TRUTH)
    return (*ours, *installed_names(STRATEGY, is_built_in))


def _plugin_strategy(found: Plugin) -> Strategy:
    """The strategy made from a plug-in: a class without arguments, a factory of a house, or a ready instance. A
    plug-in never receives the true house."""
    try:
        with redirected_and_timed(LOADING_S), found.import_path():
            factory = made = found.load()
            if isinstance(factory, type):
                made = factory()
            elif callable(factory) and not is_strategy(factory):
                made = factory(None)
    except TimeLimitReached:
        raise StrategyNotLoaded(found.name, f"it was not loaded within {LOADING_S:g} s") from None
    except (Exception, SystemExit) as error:
        raise StrategyNotLoaded(found.name, f"{type(error).__name__}: {' '.join(str(error).split())}") from error
    refused = why_refused(made)
    if refused is not None:
        raise StrategyNotLoaded(found.name, refused)
    return cast(
        Strategy, made if isinstance(made, Composed | Scout | Oracle) else GuardedStrategy(cast(Strategy, made))
    )


def why_refused(made: object) -> str | None:
    """Why what a user's code made cannot be used: it is no strategy, or it calls itself as a built-in one does and is
    another; None for one that can."""
    if not is_strategy(made):
        return f"it is {why_no_strategy(made)}"
    name = cast(Strategy, made).name
    if not is_built_in(name):
        return None
    ours = isinstance(made, Composed | Scout) and made == strategy(name)
    return None if ours else taken_name(name)


def why_no_strategy(made: object) -> str:
    """What was made in place of a strategy, and what would be one; a search policy needs a strategy around it."""
    kind = type(made).__name__
    if callable(getattr(made, "order", None)):
        return (
            f"{kind}, a search policy, which a strategy needs around it: a function of the house that returns "
            f"Composed(name=..., pricing=Expected(), policy={kind}())"
        )
    return f"{kind}; a strategy has name, relevant_types(task) and decide(view)"


def is_strategy(thing: object) -> bool:
    """Whether an object has the interface of a strategy: a name, relevant_types(task) and decide(view)."""
    named = isinstance(getattr(thing, "name", None), str)
    return named and all(callable(getattr(thing, method, None)) for method in ("relevant_types", "decide"))
