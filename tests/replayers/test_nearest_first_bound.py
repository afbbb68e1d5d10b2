"""The bound for nearest-first looks holds in every consistent world, and is exact where one item is left to find."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from toy import BED, COUNTER, DESK, item
from toy_logs import MUG, PENCIL, delivered, task_of, toy_evidence

from replayers.counterfactual.bounds.nearest_first_bound import NearestFirstBound
from replayers.counterfactual.bounds.upper_bound import UpperBound
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.relevance import Answer, Assumptions, relevance_of
from replayers.counterfactual.replay import run_tree_of
from replayers.counterfactual.run_nodes import Node, UnobservedLook
from replayers.counterfactual.run_tree import RunTree
from replayers.runs.run import read
from workbench.planning.strategies import strategy
from workbench.planning.tasks import AllOf, goal_types
from workbench.tolerances import NEAR_COST
from workbench.worlds.house import START, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start

DELIVERIES = Path(__file__).parents[2] / "logs" / "deliver-3.mcap"
PENCIL_TO_START = task_of(delivered(PENCIL, START))


def bound_of(evidence: Evidence) -> NearestFirstBound:
    return NearestFirstBound(evidence, relevance_of(evidence, goal_types(evidence.task.goal), Assumptions()))


def at_start(evidence: Evidence) -> Knowledge:
    return knowledge_at_start(evidence.place.plan, evidence.place.travel, evidence.known)


def test_by_hand_a_chain_that_may_end_at_the_last_look(tmp_path: Path) -> None:
    """Table 1, counter 3, bed 6, desk 2; there the pencil: pick 5, back 7, place 5."""
    evidence = toy_evidence(tmp_path, PENCIL_TO_START)
    assert bound_of(evidence).remaining_cost(at_start(evidence)) == 1 + 3 + 6 + 2 + 5 + 7 + 5


def test_by_hand_a_chain_ends_where_the_log_shows_the_item(tmp_path: Path) -> None:
    """Table 1, counter 3; there the log shows a mug: pick 5, back 2, place 5."""
    evidence = toy_evidence(tmp_path, task_of(delivered(MUG, START)))
    assert bound_of(evidence).remaining_cost(at_start(evidence)) == 1 + 3 + 5 + 2 + 5


def test_by_hand_only_the_places_that_are_left_count(tmp_path: Path) -> None:
    """From the start to the bed 6, to the desk 2; there the pencil: pick 5, to the counter 7, place 5."""
    task = replace(task_of(delivered(PENCIL, COUNTER)), available=(MUG, PENCIL))
    evidence = toy_evidence(tmp_path, task)
    known = at_start(evidence)
    for container in evidence.contents:
        known = known.seen(container, evidence.contents[container])
    assert bound_of(evidence).remaining_cost(known) == 6 + 2 + 5 + 7 + 5
    assert bound_of(evidence).remaining_cost(known.seen(BED, ()).moved(LocationId(BED))) == 2 + 5 + 7 + 5


def test_another_instance_that_is_known_does_not_raise_it(tmp_path: Path) -> None:
    """A mug on the desk is far from all; with one on the counter, no shortest plan fetches it."""
    both = task_of(AllOf(parts=(delivered(PENCIL, START), delivered(MUG, START))))
    evidence = toy_evidence(tmp_path, both)
    known = at_start(evidence)
    near = known.seen(COUNTER, (item("Mug|1"),))
    far = near.seen(DESK, (item("Mug|2"),))
    bound = bound_of(evidence)
    assert bound.remaining_cost(far) == bound.remaining_cost(near.seen(DESK, ()))
    assert bound.remaining_cost(known.seen(COUNTER, ()).seen(DESK, (item("Mug|2"),))) > bound.remaining_cost(far)


def test_it_says_nothing_where_its_argument_does_not_hold(tmp_path: Path) -> None:
    evidence = toy_evidence(tmp_path, PENCIL_TO_START)
    start = at_start(evidence)
    held = start.seen(COUNTER, (item("Mug|1"),)).moved(LocationId(COUNTER)).picked(item("Mug|1"))
    two_of_one = task_of(AllOf(parts=(delivered(MUG, BED), delivered(MUG, DESK))))
    assert bound_of(evidence).remaining_cost(held) == inf
    assert bound_of(evidence).remaining_cost(start.refuse_search(BED)) == inf
    assert bound_of(toy_evidence(tmp_path, two_of_one)).remaining_cost(start) == inf
    for refusing in (
        replace(evidence, refused_searches=MappingProxyType({BED: "stuck"})),
        replace(evidence, refused_moves=MappingProxyType({LocationId(BED): "blocked"})),
        replace(evidence, refused_picks=MappingProxyType({item("Mug|1").id: "too heavy"})),
        replace(evidence, misses=1),
    ):
        assert bound_of(refusing).remaining_cost(start) == inf


def one_run(
    tree: RunTree, rng: np.random.Generator, richness: float
) -> tuple[list[tuple[Node, float]], float] | None:
    """The nodes of a run in a random world, each with the cost of the way there, and the run's own cost; None where
    it fails."""

    def answer_of(unobserved: UnobservedLook) -> Answer:
        if rng.random() > richness:
            return unobserved.options[0]
        return unobserved.options[rng.integers(len(unobserved.options))]

    node, cost, passed = tree.root, 0.0, list[tuple[Node, float]]()
    while True:
        passed.append((node, cost))
        segment = tree.advance(node)
        cost += segment.cost
        if segment.unobserved is None:
            return (passed, cost) if segment.done else None
        node = tree.child(node, answer_of(segment.unobserved))


@pytest.mark.parametrize("name", ["opt-greedy", "pes-greedy"])
def test_no_run_costs_more_than_the_bound_of_any_state_on_its_way(name: str) -> None:
    """Over a log with 24 open containers, in worlds with little and with much in them."""
    prepared = prepare_log(read(DELIVERIES), ReplaySettings(worlds=0), with_paths=False)
    tree, rng = run_tree_of(prepared, strategy(name)), np.random.default_rng(7)
    bound = NearestFirstBound(prepared.evidence, tree.relevance)
    loose = UpperBound(prepared.evidence, tree.traits)
    states, closer = 0, 0
    for richness in (0.02, 0.05, 0.1, 0.2, 0.4):
        for _ in range(4):
            run = one_run(tree, rng, richness)
            if run is None:
                continue
            passed, total = run
            for node, spent in passed:
                most = bound.remaining_cost(node.knowledge)
                assert total - spent <= most + NEAR_COST
                states += 1
                closer += most < loose.direct_route_bound(node.knowledge) - NEAR_COST
    assert states > 100
    assert closer > states / 2
