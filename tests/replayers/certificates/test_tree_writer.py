"""Branches that go on as another does: a certificate of many branches is small, and the checker follows them."""

from __future__ import annotations

import json
import random
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from replayers.certificates.build import certificate
from replayers.certificates.claim import seal_of
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log, run_tree_of
from replayers.runs.run import read
from workbench.cli import run as lios
from workbench.planning.strategies import strategy

sys.path.insert(0, str(Path(__file__).parent))
from claims_made import LOGS, checker, claimed, facts

LOG, NAME = "deliver-3", "opt-greedy"


def nodes(node: Any) -> Iterator[Any]:
    yield node
    for answer in node.get("look", {}).get("answers", []):
        yield from nodes(answer["then"])


def path_in(node: Any, world: dict[str, list[str]], made: Any) -> list[int]:
    path: list[int] = []
    while "look" in (node := made.shared[node["same"]][-1] if "same" in node else node):
        answers = [[item["type"] for item in answer["items"]] for answer in node["look"]["answers"]]
        path.append(answers.index(world[node["look"]["container"]]))
        node = node["look"]["answers"][path[-1]]["then"]
    return path


def check(values: Any) -> Any:
    values["seal"] = seal_of(values)
    return checker().check(values, {facts(LOG).sha256: facts(LOG)})


def test_a_log_of_a_hundred_thousand_branches_is_certified_at_both_ends() -> None:
    values = json.loads(claimed(LOG, NAME))
    lower, upper, *_ = check(values)
    assert (round(lower, 2), round(upper, 2)) == (72.41, 190.87)
    assert values["lower"]["kind"] == values["upper"]["kind"] == "leaf"
    assert len(list(nodes(values["tree"]))) < 500


def test_every_drawn_world_costs_what_its_run_costs() -> None:
    values, rng = json.loads(claimed(LOG, NAME)), random.Random(0)
    made = checker().Check(values, facts(LOG))
    prepared = prepare_log(read(LOGS / f"{LOG}.mcap"), ReplaySettings(worlds=0), with_paths=False)
    tree = run_tree_of(prepared, strategy(NAME))
    costs: set[float] = set()
    for _ in range(200):
        leaf = tree.follow(lambda look: look.options[0 if rng.random() < 0.9 else -rng.randrange(len(look.options))])
        world = {filled.container: list(filled.answer) for filled in leaf.filled}
        assert made.cost_in(path_in(values["tree"], world, made), world, values["tree"]) == pytest.approx(leaf.cost)
        costs.add(round(leaf.cost, 2))
    assert len(costs) > 20


def test_few_branches_are_all_written_out_and_many_give_the_same_bounds() -> None:
    """Writing out each branch is what comparisons in the same world need (test_claims_compared.py)."""
    prepared = prepare_log(read(LOGS / "spot-home-A.mcap"), ReplaySettings(worlds=0), with_paths=False)
    branches = sum("end" in node for node in nodes(json.loads(claimed("spot-home-A", "pes-greedy"))["tree"]))
    assert branches > 20
    every, shared = (certificate(prepared, strategy("pes-greedy"), max_branches=n) for n in (branches, branches - 1))
    assert shared.tree != every.tree
    assert (shared.lower.cost, shared.upper.cost) == pytest.approx((every.lower.cost, every.upper.cost))


def test_a_branch_that_goes_on_from_another_state_is_refused() -> None:
    values = json.loads(claimed(LOG, NAME))
    found = [node for node in nodes(values["tree"]) if "same" in node]
    ids = sorted({node["same"] for node in found})
    for node in found[:3]:
        for other in (*ids[:40:8], ids[-1] + 1000):
            right, node["same"] = node["same"], other
            if other != right:
                with pytest.raises(checker().Refused):
                    check(values)
            node["same"] = right
    check(values)


@pytest.mark.parametrize("change", ["twice", "itself", "steps", "needs", "times"])
def test_a_branch_named_wrongly_is_refused(change: str) -> None:
    values = json.loads(claimed(LOG, NAME))
    named = [node for node in nodes(values["tree"]) if "id" in node]
    if change == "twice":
        named[0]["id"] = named[1]["id"]
    elif change == "itself":
        inside = next(node for node in named if "look" in node)
        inside["look"]["answers"][0]["then"] = {"same": inside["id"]}
    elif change == "steps":
        next(node for node in nodes(values["tree"]) if "same" in node)["steps"] = []
    elif change == "times":
        named[0]["times"] += 1
    else:
        for node in named:
            node["needs"] = []
    with pytest.raises(checker().Refused):
        check(values)


def test_why_an_end_is_not_reached_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command = ["certify", str(LOGS / f"{LOG}.mcap"), "-s", NAME, "--branches", "10", "-o"]
    assert lios([*command, str(tmp_path / "claim.lios.zip")]) == 0
    said = capsys.readouterr()
    assert "no upper bound" in said.out + said.err
    assert "note: 88 branches not followed (more are with --branches); lios replay may" in said.out + said.err
