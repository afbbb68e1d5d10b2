"""Tolerances stand in one module, and those of a kind are ordered."""

from __future__ import annotations

import ast
from pathlib import Path

from workbench import tolerances

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("workbench", "recorders", "replayers", "dashboards")
LARGEST = 1e-5
"""Smaller numbers are tolerances, unless they are parameters of a model."""
PARAMETERS = (
    "workbench/beliefs/",
    "workbench/search/remaining.py",  # values in place of probabilities of 0
    "workbench/planning/rollouts/",
    "recorders/spot/simulated/estop.py",  # nanoseconds to seconds
)


def test_tolerances_stand_in_one_module() -> None:
    found: list[str] = []
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            name = path.relative_to(ROOT).as_posix()
            if name == "workbench/tolerances.py" or name.startswith(PARAMETERS):
                continue
            found += [
                f"{name}:{node.lineno}: {node.value}"
                for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
                if isinstance(node, ast.Constant) and isinstance(node.value, float) and 0 < node.value <= LARGEST
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
