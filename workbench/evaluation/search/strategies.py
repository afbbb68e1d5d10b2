"""Strategies that follow a given search policy, so that any policy can run in the closed loop and be logged.

Policies with a strategy of the same name use that strategy; for the others, a single find is priced by Eq. 1 and
searched by the policy. `strategy_of(name)` is a name that workbench.planning.strategies understands.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from workbench.planning.composed import Composed
from workbench.planning.find_pricing import Expected
from workbench.planning.strategy import Strategy
from workbench.plugins import NameOrigin
from workbench.search.policies.registry import policy

NAMED: Mapping[str, str] = MappingProxyType(
    {
        "greedy": "opt-greedy",
        "lios": "model-lios",
        "conditioned-lios": "conditioned-lios",
        "oracle": "oracle",
        "most-probable": "most-probable",
        "marginal-lios": "marginal-lios",
        "full-lios": "full-lios",
        "robust-lios": "robust-lios",
        "sight-lios": "sight-lios",
    }
)


def strategy_of(policy_name: str) -> str | None:
    """The name of the strategy that follows a policy; None for third-party policies (see with_policy)."""
    return NAMED.get(policy_name)


def with_policy(policy_name: str) -> Strategy:
    """A strategy that follows any named policy."""
    return Composed(
        name=policy_name,
        pricing=Expected(belief_model="marginal"),
        policy=policy(policy_name, origin=NameOrigin.USER),
    )
