"""Estimates: sampled worlds are consistent with log and belief; means and probabilities follow from the samples."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from toy import BED, COUNTER, DESK, TABLE
from toy_logs import MUG, PENCIL, InOrder, toy_evidence, toy_run

from replayers import read
from replayers.batch.next_look import rank_looks
from replayers.counterfactual.bounds.bounds import Budget
from replayers.counterfactual.bounds.branch_and_bound import bounds_of
from replayers.counterfactual.estimates.estimate import costs_in, estimate_of, mass_within, predictive_interval
from replayers.counterfactual.estimates.sampled_worlds import SampledWorlds, marked, sample_worlds, worlds_of
from replayers.counterfactual.relevance import Assumptions, Relevance, relevance_of
from replayers.counterfactual.replay import ReplaySettings, prepare_log, replay_strategy, run_tree_of
from replayers.evaluation.calibration import pit_below, pit_distance, pit_histogram, pit_interval, share_within
from workbench.beliefs.belief import Belief
from workbench.execution.events import RunStatus
from workbench.planning.strategies import strategy
from workbench.planning.strategy import Decision, View
from workbench.planning.tasks import find_task
from workbench.worlds.house import START, ItemType

P_BED, P_DESK = 0.2, 0.5
LOGS = Path(__file__).parents[2] / "logs"


def drawn(tmp_path: Path, item_type: ItemType, *, exists: bool, count: int = 40_000) -> SampledWorlds:
    evidence = toy_evidence(tmp_path, find_task(item_type, START))
    relevance: Relevance = relevance_of(evidence, (), Assumptions())
    belief = Belief(
        item_types=(item_type,),
        containers=(BED, DESK),
        probability=np.array([[P_BED, P_DESK]]),
        estimator="by hand",
    )
    somewhere = frozenset({item_type}) if exists else frozenset[ItemType]()
    return sample_worlds(evidence, relevance, belief, count=count, rng=np.random.default_rng(1), exists=somewhere)


def test_draws_follow_the_belief_where_the_log_shows_an_instance(tmp_path: Path) -> None:
    """A mug was seen, so bed and desk hold one independently."""
    worlds = drawn(tmp_path, MUG, exists=True)
    assert worlds.containers == (BED, DESK)
    shares = worlds.inside[:, 0, :].mean(axis=0)
    assert shares == pytest.approx([P_BED, P_DESK], abs=0.01)
    both = float((worlds.inside[:, 0, 0] & worlds.inside[:, 0, 1]).mean())
    assert both == pytest.approx(P_BED * P_DESK, abs=0.01)


def test_what_nobody_saw_but_exists_is_in_at_least_one(tmp_path: Path) -> None:
    """Conditioned on at least one: P(bed) = 0.2 / 0.6, P(desk) = 0.5 / 0.6, P(both) = 0.1 / 0.6."""
    worlds = drawn(tmp_path, PENCIL, exists=True)
    inside = worlds.inside[:, 0, :]
    assert inside.any(axis=1).all()
    some = 1 - (1 - P_BED) * (1 - P_DESK)
    assert inside.mean(axis=0) == pytest.approx([P_BED / some, P_DESK / some], abs=0.01)
    assert float(inside.all(axis=1).mean()) == pytest.approx(P_BED * P_DESK / some, abs=0.01)


def test_what_need_not_exist_may_be_nowhere(tmp_path: Path) -> None:
    inside = drawn(tmp_path, PENCIL, exists=False).inside
    assert float((~inside.any(axis=(1, 2))).mean()) == pytest.approx(0.4, abs=0.01)


def test_the_same_seed_draws_the_same_worlds(tmp_path: Path) -> None:
    a, b = (drawn(tmp_path, MUG, exists=True, count=50).inside for _ in range(2))
    assert (a == b).all()
    assert not a.flags.writeable


def test_an_estimate_is_the_mean_over_the_drawn_worlds(tmp_path: Path) -> None:
    """Bed first: 17 with a mug in the bed, else 20 with one in the desk, else 24 (test_replay_bounds.py)."""
    prepared = prepare_log(toy_run(tmp_path), ReplaySettings(worlds=4000))
    made = replay_strategy(prepared, InOrder((BED, DESK, TABLE, COUNTER)))
    assert made.estimate is not None
    assert made.drawn is not None
    assert prepared.worlds is not None
    bed, desk = prepared.worlds.inside[:, 0, 0], prepared.worlds.inside[:, 0, 1]
    by_hand = np.where(bed, 17.0, np.where(desk, 20.0, 24.0))
    assert made.drawn == pytest.approx(by_hand)
    assert made.estimate.mean == pytest.approx(by_hand.mean())
    assert made.estimate.ci95[0] < made.estimate.mean < made.estimate.ci95[1]
    assert made.estimate.success == 1.0


@pytest.mark.parametrize("name", ["opt-lios", "opt-greedy"])
@pytest.mark.parametrize("followed", [0, 40])
def test_worlds_that_go_down_the_tree_together_end_as_each_does_alone(name: str, followed: int) -> None:
    """Whatever was followed before: the same costs, in as many segments."""
    prepared = prepare_log(read(LOGS / "deliver-3.mcap"), ReplaySettings(worlds=80), with_paths=False)
    worlds = prepared.worlds
    assert worlds is not None
    together, one_by_one = (run_tree_of(prepared, strategy(name)) for _ in range(2))
    for tree in (together, one_by_one):
        bounds_of(tree, budget=Budget(segments=followed, finish=0))
    leaves = [one_by_one.follow(worlds.chooser(world)) for world in range(len(worlds))]
    for _ in range(2):  # the second time every end is known
        costs, done = costs_in(worlds, together)
        assert costs.tolist() == [leaf.cost for leaf in leaves]
        assert done.tolist() == [leaf.status is RunStatus.DONE for leaf in leaves]
    assert together.segments == one_by_one.segments
    assert list(together.asked) == list(one_by_one.asked)


def test_answers_name_the_types_that_still_matter(tmp_path: Path) -> None:
    worlds = drawn(tmp_path, MUG, exists=False, count=20)
    assert [worlds.answer(world, DESK, (MUG,)) for world in range(len(worlds))] == [
        (MUG,) if there else () for there in worlds.inside[:, 0, 1]
    ]
    assert worlds.answers(DESK, ()) == (((), worlds_of(np.ones(len(worlds), dtype=bool))),)
    for answer, some in worlds.answers(DESK, (MUG,)):
        assert (marked(some, len(worlds)) == (worlds.inside[:, 0, 1] == bool(answer))).all()


def test_more_worlds_narrow_the_interval_of_the_mean_but_not_of_the_cost() -> None:
    rng = np.random.default_rng(0)
    few, many = rng.normal(50, 10, 100), rng.normal(50, 10, 10_000)
    a, b = (estimate_of(c, np.ones(len(c), dtype=bool)) for c in (few, many))
    assert b.ci95[1] - b.ci95[0] < (a.ci95[1] - a.ci95[0]) / 5
    assert b.interval90[1] - b.interval90[0] == pytest.approx(2 * 1.645 * 10, rel=0.05)
    assert b.interval90_mass == pytest.approx(0.9)


def test_one_world_gives_a_point() -> None:
    one = estimate_of(np.array([7.0]), np.array([True]))
    assert one.ci95 == one.interval90 == (7.0, 7.0)


def test_the_predictive_interval_is_the_shortest_that_holds_nine_in_ten() -> None:
    assert predictive_interval(np.arange(1000.0)) == (0.0, 899.0)
    lumps = np.array([10.0] * 60 + [20.0] * 32 + [400.0] * 8)
    assert predictive_interval(lumps) == (10.0, 20.0)
    assert mass_within(lumps, (10.0, 20.0)) == 0.92
    assert predictive_interval(np.array([1.0, 2.0])) == (1.0, 2.0)


@given(st.lists(st.integers(0, 12), min_size=1, max_size=40), st.sampled_from([0.5, 0.9, 1.0]))
def test_no_shorter_interval_holds_as_much(costs: list[int], mass: float) -> None:
    drawn = np.array(costs, dtype=np.float64)
    low, high = predictive_interval(drawn, mass)
    assert mass_within(drawn, (low, high)) >= mass - 1e-9
    for a, b in itertools.combinations_with_replacement(sorted(set(costs)), 2):
        if b - a < high - low:
            assert mass_within(drawn, (a, b)) < mass


def test_a_truth_at_an_end_counts_by_what_lies_inside() -> None:
    """Costs 10 (half) and 20 (half): the central 90 % holds 0.45 of each half, so each counts nine tenths."""
    costs = np.array([10.0] * 50 + [20.0] * 50)
    within = {c: share_within(pit_interval(costs, c)) for c in (5.0, 10.0, 15.0, 20.0, 25.0)}
    assert [within[10.0], within[20.0]] == pytest.approx([0.9, 0.9])
    assert [within[5.0], within[15.0], within[25.0]] == [0.0, 1.0, 0.0]
    assert share_within(pit_interval(np.full(100, 7.0), 7.0)) == pytest.approx(0.9)
    assert pit_interval(costs, 20.0) == (0.5, 1.0)
    assert pit_below((0.5, 1.0), 0.6) == pytest.approx(0.2)


def test_calibrated_lumps_give_an_even_transform_and_cover_what_they_aim_at() -> None:
    rng = np.random.default_rng(3)
    values, chances = np.array([1.0, 2.0, 3.0]), np.array([0.2, 0.7, 0.1])
    draws = rng.choice(values, size=20_000, p=chances)
    truths = rng.choice(values, size=2_000, p=chances)
    stretches = [pit_interval(draws, t) for t in truths.tolist()]
    assert np.mean([share_within(s) for s in stretches]) == pytest.approx(0.9, abs=0.01)
    assert pit_histogram(stretches) == pytest.approx([0.1] * 10, abs=0.01)
    distance = pit_distance(stretches)
    assert distance is not None
    assert distance < 0.02
    too_low = [pit_interval(draws - 1, t) for t in truths.tolist()]
    assert (pit_distance(too_low) or 0.0) > 0.3
    assert pit_histogram([]) == ()
    assert pit_distance([]) is None


def test_the_most_telling_look_is_the_one_that_decides_who_wins(tmp_path: Path) -> None:
    """One strategy looks into the bed, the other never does: whether a mug is there decides between them."""
    prepared = prepare_log(toy_run(tmp_path), ReplaySettings(worlds=2000))
    worlds = prepared.worlds
    assert worlds is not None
    inside = worlds.inside.copy()
    inside[:, 0, 0] = np.arange(len(worlds)) % 2 == 0
    worlds = replace(worlds, inside=inside)
    prepared = replace(prepared, worlds=worlds)
    plans = {"bed": InOrder((BED, TABLE, COUNTER)), "table": InOrder((TABLE, BED, COUNTER))}
    made = {name: replay_strategy(prepared, plan) for name, plan in plans.items()}
    costs = {name: r.drawn for name, r in made.items() if r.drawn is not None}
    looks = rank_looks(worlds, costs, {c for r in made.values() for c in r.asked})
    assert [look.container for look in looks] == [BED]
    assert looks[0].doubt == pytest.approx(0.5)
    assert looks[0].settles == pytest.approx(0.5)
    assert looks[0].narrows > 0
    assert looks[0].chance_found == 0.5


def test_a_look_that_settles_nothing_settles_zero_and_not_a_rounding_error_below() -> None:
    """Costs are the same in each ten worlds, whatever the bed holds in them; the first of three tens is a group."""
    inside = np.zeros((30, 1, 2), dtype=bool)
    inside[:10, 0, 0] = True
    worlds = SampledWorlds(item_types=(MUG,), containers=(BED, DESK), inside=inside)
    for wins in range(1, 10):
        for ties in range(10 - wins):
            ten = np.array([1.0] * wins + [2.0] * ties + [3.0] * (10 - wins - ties))
            looks = rank_looks(worlds, {"a": np.tile(ten, 3), "b": np.full(30, 2.0)}, {BED, DESK})
            assert all(look.settles == pytest.approx(0) for look in looks)
            assert all(look.settles >= 0 and look.narrows >= 0 for look in looks)


def test_a_strategy_that_decides_otherwise_when_asked_again_is_named(tmp_path: Path) -> None:
    class Wavers(InOrder):
        """Turns its order round with every run that it begins."""

        turns: list[int] = []  # noqa: RUF012

        def decide(self, view: View) -> Decision:
            if view.knowledge.robot_at == START:
                self.turns.append(1)
            order = self.order if len(self.turns) % 2 else self.order[::-1]
            return InOrder(order).decide(view)

    prepared = prepare_log(toy_run(tmp_path), ReplaySettings(worlds=0))
    made = replay_strategy(prepared, Wavers((TABLE, COUNTER, BED, DESK)))
    assert any("not deterministic" in note for note in made.notes)
    steady = replay_strategy(prepared, InOrder((TABLE, COUNTER)))
    assert not any("not deterministic" in note for note in steady.notes)
