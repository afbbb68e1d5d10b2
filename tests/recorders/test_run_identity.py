"""One builder of a run's identity, one recipe of its id, and one set-up of the loop."""

from __future__ import annotations

import ast

import pytest
from product_source import nodes

from recorders.run_identity import Driver, run_id, run_info
from workbench.log_schema.events import SCHEMA_VERSION
from workbench.planning.tasks import find_task
from workbench.worlds.house import START, ItemType


def test_the_same_parts_have_the_same_id_and_others_another() -> None:
    assert run_id("a", b"b") == run_id(b"a", "b") == "fb8e20fc2e4c"
    assert run_id("a", "c") != run_id("a", "b")


def test_the_identity_tells_who_drove_and_by_which_weights() -> None:
    task = find_task(ItemType("Mug"), START)
    info = run_info(task, Driver(strategy="s", estimator="fcnn@12", seed=3), id="1", place="houses:0", started_ns=5)
    told = (info.strategy, info.estimator, info.weights_sha256, info.seed, info.started.ns, info.source)
    assert told == ("s", "fcnn@12", "12", 3, 5, "simulation")
    assert (info.title, info.schema_version) == (task.title, SCHEMA_VERSION)


@pytest.mark.parametrize(
    ("call", "allowed"),
    [
        ("RunInfo", {"recorders/run_identity.py"}),
        # Replays run the loop over logs, which have their own estimator, clock and start.
        ("run_task", {"workbench/execution/setup.py", "replayers/counterfactual"}),
    ],
)
def test_nothing_else_builds_an_identity_or_starts_the_loop(call: str, allowed: set[str]) -> None:
    found = {name for name, node in nodes(ast.Call) if isinstance(node.func, ast.Name) and node.func.id == call}
    assert [path for path in found if not path.startswith(tuple(allowed))] == []
