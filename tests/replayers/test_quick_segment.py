"""Segments without events are those of the closed loop, wherever a search goes; the rest is left to the loop."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from toy import BED, FRIDGE
from toy_logs import MUG, Even, done_by, toy_evidence

from replayers import read
from replayers.counterfactual import run_tree
from replayers.counterfactual.bounds.bounds import Budget
from replayers.counterfactual.bounds.branch_and_bound import bounds_of
from replayers.counterfactual.decisions.decided import Asked
from replayers.counterfactual.evidence import Evidence, is_plain
from replayers.counterfactual.prepared_log import PreparedLog, ReplaySettings, prepare_log
from replayers.counterfactual.replay import run_tree_of
from replayers.counterfactual.run_nodes import Node, Segment
from replayers.counterfactual.run_tree import RunTree
from replayers.counterfactual.tree.quick_segment import QuickRun
from workbench.planning.strategies import strategy
from workbench.planning.tasks import find_task
from workbench.plugins import NameOrigin
from workbench.worlds.house import START, LocationId
from workbench.worlds.knowledge import knowledge_at_start

LOGS = Path(__file__).parents[2] / "logs"
FEW = Budget(segments=40, finish=40)


def never(evidence: Evidence) -> bool:
    return False


def looped(prepared: PreparedLog, name: str, monkeypatch: pytest.MonkeyPatch) -> RunTree:
    """A tree all of whose segments the closed loop runs."""
    with monkeypatch.context() as patched:
        patched.setattr(run_tree, "is_plain", never)
        return run_tree_of(prepared, strategy(name))


def nodes_below(node: Node) -> list[Node]:
    found: dict[int, Node] = {id(node): node}
    waiting = [node]
    while waiting:
        for child in waiting.pop().children.values():
            if id(child) not in found:
                found[id(child)] = child
                waiting.append(child)
    return list(found.values())


def facts(segment: Segment) -> tuple[object, ...]:
    decided = [done_by(one) for one in segment.decided]
    return (segment.cost, segment.steps, segment.picks, segment.unobserved, segment.ended, decided)


@pytest.mark.parametrize(
    ("log", "name", "estimator"),
    [
        ("deliver-3", "opt-greedy", "log"),
        ("deliver-3", "pes-greedy", "best"),
        ("deliver-3", "opt-lios", "log"),
        ("deliver-3", "model-lios", "counts"),
        ("deliver-3", "conditioned-lios", "counts"),
        ("deliver-3", "scout-lios", "log"),
        ("deliver-3", "conditioned-lios", "best"),
        ("find-lios", "conditioned-lios", "counts"),
        ("breakfast", "model-lios", "log"),
        ("cut-off", "opt-lios", "log"),
    ],
)
def test_every_segment_is_that_of_the_closed_loop(
    log: str, name: str, estimator: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = ReplaySettings(worlds=0, budget=FEW, estimator=estimator, estimator_origin=NameOrigin.USER)
    prepared = prepare_log(read(LOGS / f"{log}.mcap"), settings, with_paths=False)
    quick, loop = run_tree_of(prepared, strategy(name)), looped(prepared, name, monkeypatch)
    made, again = bounds_of(quick, budget=FEW), bounds_of(loop, budget=FEW)
    assert (made.lower, made.upper, made.groups) == (again.lower, again.upper, again.groups)
    followed = [node for node in nodes_below(quick.root) if node.segment is not None]
    assert len(followed) == quick.segments > 0
    for node in followed:
        alike = Node(knowledge=node.knowledge, imputed=node.imputed, steps=node.steps, picks=node.picks)
        assert node.segment is not None
        assert facts(loop.advance(alike)) == facts(node.segment)
        for decided in node.segment.decided:
            assert done_by(Asked(decided.basis, decided.made)) == done_by(decided)


def quick_run(evidence: Evidence) -> QuickRun:
    return QuickRun(evidence, strategy("opt-greedy"), Even(), seed=0)


def test_at_the_step_limit_the_closed_loop_takes_over(tmp_path: Path) -> None:
    evidence = toy_evidence(tmp_path, find_task(MUG, START))
    root = knowledge_at_start(evidence.place.plan, evidence.travel, evidence.known)
    made = quick_run(evidence).segment(root, steps_left=100)
    assert made is not None
    assert made.steps > 0
    assert quick_run(evidence).segment(root, steps_left=made.steps) is None


def test_what_is_refused_is_left_to_the_closed_loop(tmp_path: Path) -> None:
    evidence = toy_evidence(tmp_path, find_task(MUG, START))
    assert is_plain(evidence)
    assert not is_plain(replace(evidence, refused_moves={LocationId(BED): "the door is shut"}))
    assert not is_plain(replace(evidence, refused_searches={FRIDGE: "it does not open"}))
    assert not is_plain(replace(evidence, misses=1))
