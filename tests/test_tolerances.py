"""Tolerances stand in one module, and those of a kind are ordered."""

from __future__ import annotations

import ast

from product_source import nodes

from workbench import tolerances

LARGEST = 1e-5
"""Smaller numbers are tolerances, unless they are parameters of a model."""
PARAMETERS = (
    "workbench/beliefs/",
    "workbench/search/remaining.py",  # values in place of probabilities of 0
    "workbench/planning/rollouts/",
    "recorders/spot/simulated/estop.py",  # nanoseconds to seconds
)


def test_tolerances_stand_in_one_module() -> None:
    found = [
        f"{name}:{node.lineno}: {node.value}"
        for name, node in nodes(ast.Constant)
        if name != "workbench/tolerances.py" and not name.startswith(PARAMETERS)
        if isinstance(node.value, float) and 0 < node.value <= LARGEST
    ]
    assert found == [], "name it in workbench/tolerances.py"


def test_tolerances_of_costs_grow_with_the_rounding_behind_them() -> None:
    assert (
        tolerances.NEAR_COST
        < tolerances.NEAR_ROUNDED
        < tolerances.NEAR_LOGGED_COST
        < tolerances.NEAR_SAMPLED_COST
        < tolerances.NEAR_LOGGED_SUM
        < tolerances.NEAR_SHOWN_COST
    )
    assert tolerances.RELATIVE * 100 < tolerances.NEAR_COST
