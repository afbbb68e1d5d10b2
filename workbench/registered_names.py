"""The names that options take for strategies, policies, estimators, scenarios and solvers, each in one line.

Light to import, since Tab completion reads it: the registries themselves are not imported. A test compares the names
here with theirs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from workbench.plugins import ESTIMATOR, POLICY, SOLVER, STRATEGY, PluginKind, installed_entries, left_out

STRATEGIES: Mapping[str, str] = MappingProxyType(
    {
        "opt-greedy": "Plans as if everything lay where it is needed; searches the nearest container first (paper).",
        "pes-greedy": "Plans as if every find took the whole house; searches the nearest container first (paper).",
        "opt-lios": "Plans as opt-greedy; searches by Eq. 1 of the paper (paper).",
        "pes-lios": "Plans as pes-greedy; searches by Eq. 1 of the paper (paper).",
        "model-lios": "Plans with the find costs of Eq. 1 and searches by them (paper).",
        "conditioned-lios": "As model-lios, given that the object exists and was not found so far.",
        "scout-lios": "Simulates the next steps in drawn houses and takes the step that came out cheapest.",
        "oracle": "Knows the house; a lower end for comparison, for simulation alone.",
        "marginal-lios": "Variant: find costs of the whole search under the marginal belief.",
        "full-lios": "Variant: as marginal-lios, optimised over all unsearched containers.",
        "most-probable": "Variant: as marginal-lios, searching the most probable container first.",
        "model-lios-per-find": "Variant: model-lios with candidates chosen for each find.",
        "conditioned-lios-per-find": "Variant: conditioned-lios with candidates chosen for each find.",
        "robust-lios": "As conditioned-lios; where looks can miss, it plans to look again.",
        "sight-lios": "As conditioned-lios; counts what the robot sees on each path (--sees).",
    }
)

POLICIES: Mapping[str, str] = MappingProxyType(
    {
        "greedy": "The nearest unsearched container first (paper).",
        "most-probable": "The most probable container first.",
        "lios": "Least expected cost by Eq. 1 of the paper, probabilities taken as independent (paper).",
        "conditioned-lios": "Least expected cost, given that the object exists.",
        "marginal-lios": "Least expected cost under the marginal belief.",
        "full-lios": "Expected cost optimised over all unsearched containers, not a few candidates.",
        "robust-lios": "As conditioned-lios; where looks can miss, the best sequence of looks, some repeated.",
        "sight-lios": "As conditioned-lios; counts what the robot sees on each path.",
    }
)

ESTIMATORS: Mapping[str, str] = MappingProxyType(
    {
        "counts": "Smoothed frequencies of item types in container types.",
        "fcnn": "The paper's network over names of items, containers and rooms.",
        "best": "Boosted trees with what was seen so far in the house; the most accurate here.",
        "people": "Where people say that things belong (Housekeep's votes), whatever houses are like.",
        "mixed": "Three quarters best, a quarter people.",
    }
)

SCENARIOS: Mapping[str, str] = MappingProxyType(
    {
        "find": "One item brought to the start, as record --find asks.",
        "deliver-3": "Three items to three places; deliver-N for N items (paper).",
        "breakfast": "An egg, a bread or the like, prepared and served (paper).",
        "coffee": "Coffee made and served in a mug (paper).",
        "breakfast+coffee": "Both (paper).",
        "any-of-three": "One of three items to its place; any-of-N for N items (paper).",
    }
)

SOLVERS: Mapping[str, str] = MappingProxyType(
    {
        "built-in": "A* over the task's own state space; nothing to install.",
        "sas-blind": "Fast Downward on SAS+, A* without a heuristic.",
        "sas-lmcut": "Fast Downward on SAS+, A* with LM-cut: optimal.",
        "sas-ff-astar": "Fast Downward on SAS+, A* with the FF heuristic.",
        "sas-ff-astar2": "Fast Downward on SAS+, the paper's search: weighted A* (2) with the FF heuristic.",
        "sas-anytime": "Fast Downward on SAS+, the best plan found in its time.",
        "pddl-blind": "Fast Downward on PDDL, A* without a heuristic.",
        "pddl-lmcut": "Fast Downward on PDDL, A* with LM-cut: optimal.",
        "pddl-ff-astar": "Fast Downward on PDDL, A* with the FF heuristic.",
        "pddl-ff-astar2": "Fast Downward on PDDL, as the paper plans: weighted A* (2) with the FF heuristic.",
        "pddl-anytime": "Fast Downward on PDDL, the best plan found in its time.",
    }
)

_BUILT_IN: Mapping[str, tuple[Mapping[str, str], PluginKind | None]] = MappingProxyType(
    {
        "strategies": (STRATEGIES, STRATEGY),
        "policies": (POLICIES, POLICY),
        "estimators": (ESTIMATORS, ESTIMATOR),
        "scenarios": (SCENARIOS, None),
        "solvers": (SOLVERS, SOLVER),
    }
)

KIND_OF_OPTION: Mapping[str, str] = MappingProxyType(
    {
        "--strategy": "strategies",
        "--strategies": "strategies",
        "--policy": "policies",
        "--policies": "policies",
        "--estimator": "estimators",
        "--estimators": "estimators",
        "--paper-estimator": "estimators",
        "--scenario": "scenarios",
        "--scenarios": "scenarios",
        "--solver": "solvers",
    }
)
"""Which names an option takes, by its spelling; it holds in every command."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RegisteredName:
    """A name that an option takes.

    Attributes:
        line: what it stands for, in one line; for an installed plug-in, the object behind it.
        source: "built in", or the distribution that installs it.
    """

    name: str
    line: str
    source: str


def registered_names(kind: str) -> tuple[RegisteredName, ...]:
    """The names of a kind: built-in ones in the order of their table, then installed plug-ins, sorted.

    Args:
        kind: strategies, policies, estimators, scenarios or solvers.
    """
    lines, plugins = _BUILT_IN[kind]
    ours = tuple(RegisteredName(name=name, line=line, source="built in") for name, line in lines.items())
    if plugins is None:
        return ours
    others = (
        RegisteredName(name=entry.name, line=entry.value, source=entry.dist.name if entry.dist else "")
        for entry in installed_entries(plugins, lambda name: _is_built_in(kind, name))
    )
    return (*ours, *others)


def left_out_names(kind: str) -> tuple[str, ...]:
    """The installed plug-ins of a kind whose names are taken, in one line each."""
    plugins = _BUILT_IN[kind][1]
    return left_out(plugins, lambda name: _is_built_in(kind, name)) if plugins is not None else ()


def _is_built_in(kind: str, name: str) -> bool:
    """Whether a built-in one wins over an installed one of that name; aliases too. Asked of installed ones alone,
    since it imports the registries."""
    if kind == "strategies":
        from workbench.planning.strategies import is_built_in
    elif kind == "estimators":
        from workbench.beliefs.estimators import is_built_in
    elif kind == "solvers":
        from workbench.planning.solvers.registry import is_built_in
    else:
        from workbench.search.policies.registry import is_built_in
    return is_built_in(name)


def completions(option_spellings: tuple[str, ...], incomplete: str) -> list[str]:
    """What Tab makes of an incomplete value: the last of names separated by commas is completed."""
    kind = next((KIND_OF_OPTION[s] for s in option_spellings if s in KIND_OF_OPTION), None)
    if kind is None:
        return []
    before, comma, begun = incomplete.rpartition(",")
    given = set(before.split(","))
    return [
        f"{before}{comma}{known.name}"
        for known in registered_names(kind)
        if known.name.startswith(begun) and known.name not in given
    ]
