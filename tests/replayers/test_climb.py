"""Climbs to the cheapest and the most expensive run over a breakfast log, most of whose worlds are not followed."""

from __future__ import annotations

from pathlib import Path

import pytest
from consistent_worlds import is_consistent, read_facts, run_in, world_around

from replayers.counterfactual.bounds.bounds import Bounds, Budget
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.replay import replay_on
from replayers.runs.run import read

LOG = Path(__file__).parents[2] / "logs" / "breakfast.mcap"


def bounded(*, climb: int) -> Bounds:
    budget = Budget(segments=20, finish=0, climb=climb)
    made = replay_on(prepare_log(read(LOG), ReplaySettings(worlds=5, budget=budget), with_paths=False), "pes-greedy")
    assert made.bounds is not None
    return made.bounds


def test_ends_that_a_climb_finds_are_further_out_and_cost_what_it_says() -> None:
    short, long = bounded(climb=0), bounded(climb=60)
    assert (short.lower, short.upper) == (long.lower, long.upper), "a climb bounds nothing"
    assert long.least_found <= short.least_found
    assert long.largest_found > short.largest_found + 1
    facts = read_facts(LOG)
    for leaf, cost in ((long.cheapest, long.least_found), (long.most_expensive, long.largest_found)):
        assert leaf is not None
        world = world_around(facts, {f.container: f.answer for f in leaf.filled})
        assert world is not None
        assert is_consistent(facts, world)
        assert run_in(facts, world, "pes-greedy").cost == pytest.approx(cost) == pytest.approx(leaf.cost)
