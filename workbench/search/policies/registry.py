"""The table of search policies by name, and a third party's by entry point or `module:function`.

A policy of your own is an entry point in the group "lios.policies" whose value is a function without arguments
that returns a SearchPolicy, or a "module:function" where a user gives a name (workbench/plugins.py).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import cast

from workbench.plugins import (
    POLICY,
    NameOrigin,
    Plugin,
    PluginNotLoaded,
    installed_names,
    plugin,
    taken_name,
    tell_left_out,
)
from workbench.search.policies.full_tour import FullTour
from workbench.search.policies.least_expected_cost import LeastExpectedCost
from workbench.search.policies.most_probable import MostProbable
from workbench.search.policies.nearest_first import NearestFirst
from workbench.search.policies.oracle import oracle_policy
from workbench.search.policies.robust import Robust
from workbench.search.policies.sight import SightAware
from workbench.search.policy import SearchPolicy

PolicyFactory = Callable[[], SearchPolicy]

POLICIES: Mapping[str, PolicyFactory] = MappingProxyType(
    {
        "greedy": lambda: NearestFirst(),
        "most-probable": lambda: MostProbable(),
        "lios": lambda: LeastExpectedCost(name="lios", belief_model="independent", ranking="probable"),
        "conditioned-lios": lambda: LeastExpectedCost(
            name="conditioned-lios", belief_model="exists", ranking="worth"
        ),
        "marginal-lios": lambda: LeastExpectedCost(name="marginal-lios", belief_model="marginal", ranking="worth"),
        "full-lios": lambda: FullTour(),
        "robust-lios": lambda: Robust(),
        "sight-lios": lambda: SightAware(),
    }
)
"""Policies that do not know the true house. For the oracle see oracle_policy(house)."""

WHERE_LOOKS_MISS = ("robust-lios",)
"""Policies that differ from others only where looks can miss; elsewhere they are not part of "all"."""

WHERE_ROBOT_SEES = ("sight-lios",)
"""Policies that differ from others only for a robot that sees in passing; they are not part of "all"."""


def policy(name: str, *, origin: NameOrigin = NameOrigin.LOG) -> SearchPolicy:
    """The policy of that name, of an installed plug-in, or of "module:function".

    Args:
        origin: who gives the name; "module:function" is for users alone.

    Raises:
        UnknownName: no such policy; lists the known ones.
        NotFromLog: a name that only a user may give.
        PluginNotLoaded: a plug-in or "module:function" that cannot be imported or made.
    """
    wanted = canonical_policy(name)
    if wanted is not None:
        if origin is NameOrigin.USER:
            tell_left_out(POLICY, name)
        return POLICIES[wanted]()
    return _from_outside(plugin(POLICY, name, origin=origin, known=POLICIES))


def canonical_policy(name: str) -> str | None:
    """The canonical name of a policy, given in any case or in the paper's spelling (ConditionedLIOS); None for
    others."""
    joined = {ours.replace("-", ""): ours for ours in POLICIES}
    wanted = name.strip().lower()
    return wanted if wanted in POLICIES else joined.get(wanted)


def is_built_in(name: str) -> bool:
    """Whether a name, or the paper's spelling, stands for a policy of the table."""
    return canonical_policy(name) is not None


def policy_names(*, looks_miss: bool = False) -> tuple[str, ...]:
    """All policies that do not need the true house: the table in its order, then installed plug-ins, sorted.

    Args:
        looks_miss: with those that differ from others only where looks can miss.
    """
    left_out = WHERE_ROBOT_SEES if looks_miss else (*WHERE_LOOKS_MISS, *WHERE_ROBOT_SEES)
    ours = tuple(name for name in POLICIES if name not in left_out)
    return (*ours, *installed_names(POLICY, is_built_in))


def _from_outside(found: Plugin) -> SearchPolicy:
    """What a class or function without arguments makes, or a ready policy."""
    try:
        with found.import_path():
            made = found.load()
            made = made() if isinstance(made, type) or (callable(made) and not _is_policy(made)) else made
    except (Exception, SystemExit) as error:
        raise PluginNotLoaded(POLICY, found.name, f"{type(error).__name__}: {error}") from error
    if not _is_policy(made):
        raise PluginNotLoaded(
            POLICY, found.name, f"it is {type(made).__name__}; a search policy has name and order(query)"
        )
    if is_built_in(cast(SearchPolicy, made).name) and not _is_ours(made):
        raise PluginNotLoaded(POLICY, found.name, taken_name(cast(SearchPolicy, made).name))
    return cast(SearchPolicy, made)


def _is_ours(made: object) -> bool:
    """Whether a policy is one of the table, as a function that picks one returns it."""
    return any(made == make() for make in POLICIES.values())


def _is_policy(thing: object) -> bool:
    return callable(getattr(thing, "order", None)) and isinstance(getattr(thing, "name", None), str)


__all__ = ["POLICIES", "PolicyFactory", "canonical_policy", "oracle_policy", "policy", "policy_names"]
