"""Items that no plan needs tell no states apart: the runs are the same without them, and far fewer."""

from __future__ import annotations

import random
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, item
from toy_logs import BOOK, MUG, PENCIL, delivered, task_of, toy_evidence

from replayers.counterfactual.bounds.bounds import DEFAULT_BUDGET, Budget
from replayers.counterfactual.bounds.branch_and_bound import bounds_of
from replayers.counterfactual.bounds.search_cache import SearchCache
from replayers.counterfactual.bounds.world_search import search_worlds
from replayers.counterfactual.decisions.needed_items import NeededItems, needed_items
from replayers.counterfactual.decisions.one_plan import fill_everywhere
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.prepared_log import PreparedLog, ReplaySettings, prepare_log
from replayers.counterfactual.replay import run_tree_of
from replayers.counterfactual.results import Proof
from replayers.counterfactual.run_nodes import UnobservedLook
from replayers.runs.run import read
from workbench.arrays import Floats
from workbench.execution.events import RunEnded
from workbench.planning.strategies import strategy
from workbench.planning.tasks import AllOf
from workbench.search.policies.nearest_first import NearestFirst
from workbench.search.policies.registry import policy
from workbench.tolerances import NEAR_COST
from workbench.worlds.house import START, ContainerId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.travel import TravelCosts

DELIVERIES = Path(__file__).parents[2] / "logs" / "deliver-3.mcap"
TWO = task_of(AllOf(parts=(delivered(MUG, START), delivered(PENCIL, START))))


@pytest.fixture(scope="module")
def prepared() -> PreparedLog:
    return prepare_log(read(DELIVERIES), ReplaySettings(worlds=0), with_paths=False)


def with_radii(evidence: Evidence, **radii: float) -> Evidence:
    """The evidence in a place where every path leads through one hub."""
    by = {START: 1.0, FRIDGE: 2.0, COUNTER: 3.0, TABLE: 4.0, BED: 5.0, DESK: 6.0} | radii
    names = evidence.place.travel.locations
    metres = np.array([[0.0 if a == b else by[a] + by[b] for b in names] for a in names])
    travel = TravelCosts(locations=names, metres=metres)
    return replace(evidence, place=replace(evidence.place, travel=travel))


def without(evidence: Evidence, container: str) -> Evidence:
    """The evidence in a place where a container cannot be reached."""
    travel = evidence.place.travel
    kept = [i for i, name in enumerate(travel.locations) if name != container]
    names = tuple(travel.locations[i] for i in kept)
    cut = TravelCosts(
        locations=names, metres=travel.metres[np.ix_(kept, kept)], unreachable=(ContainerId(container),)
    )
    return replace(evidence, place=replace(evidence.place, travel=cut))


def knowing(evidence: Evidence, **contents: str) -> Knowledge:
    """The state at the start of a run that knows of one item in each of some containers, and of nothing in the
    fridge."""
    names = {"counter": COUNTER, "table": TABLE, "bed": BED, "desk": DESK}
    known = knowledge_at_start(evidence.place.plan, evidence.place.travel, {FRIDGE: ()})
    for name, thing in contents.items():
        known = known.seen(names[name], (item(thing),) if thing else ())
    return known


def metres_along(evidence: Evidence, *places: str) -> float:
    metres = (evidence.place.travel.between(LocationId(a), LocationId(b)) for a, b in pairwise(places))
    return sum(length or 0.0 for length in metres)


def needed_in(evidence: Evidence, by: str = "greedy") -> NeededItems:
    made = needed_items(evidence, policy(by))
    assert made is not None
    return made


def containers_of(items: NeededItems, item_type: ItemType, known: Knowledge) -> list[str]:
    return [at for at, _ in items.of(item_type, known)]


def test_by_hand_the_mug_that_is_nowhere_the_nearest_is_not_needed(tmp_path: Path) -> None:
    """Every path leads through the hub: the mug on the counter (3 m from it) is nearer than that in the bed (5 m),
    except for a robot that stands at the bed. Pencils are missing, the table and the desk are left."""
    evidence = with_radii(toy_evidence(tmp_path, TWO))
    items, known = needed_in(evidence), knowing(evidence, counter="Mug|1", bed="Mug|2")
    assert containers_of(items, MUG, known) == [COUNTER]
    assert containers_of(items, MUG, known.moved(LocationId(BED))) == sorted([BED, COUNTER])


def test_by_hand_while_something_is_missing_the_places_that_are_left_count(tmp_path: Path) -> None:
    """The desk is next to the bed: a robot that looked there for the pencil takes the mug from the bed. With the
    pencil found, nobody goes there any more."""
    evidence = toy_evidence(tmp_path, TWO)
    items = needed_in(evidence)
    known = knowing(evidence, counter="Mug|1", bed="Mug|2")
    by_bed, by_counter = (metres_along(evidence, DESK, at, START) for at in (BED, COUNTER))
    assert by_bed <= by_counter
    assert containers_of(items, MUG, known) == sorted([BED, COUNTER])
    assert containers_of(items, MUG, known.seen(TABLE, (item("Pencil|1"),))) == [COUNTER]


def test_what_cannot_be_reached_is_missing(tmp_path: Path) -> None:
    """A pencil is in the fridge, where the robot cannot go, so it looks elsewhere for one: into the desk, which is
    next to the bed."""
    evidence = without(toy_evidence(tmp_path, TWO), FRIDGE)
    known = knowing(evidence, counter="Mug|1", bed="Mug|2").seen(FRIDGE, (item("Pencil|1"),))
    assert containers_of(needed_in(evidence), MUG, known) == sorted([BED, COUNTER])
    at_table = known.seen(TABLE, (item("Pencil|2"),))
    assert containers_of(needed_in(evidence), MUG, at_table) == [COUNTER]


def test_with_something_in_hand_and_nowhere_left_to_look_there_is_one_plan(tmp_path: Path) -> None:
    """The mug is in the hand and nobody knows of a pencil: no plan is left, so none is another."""
    evidence = toy_evidence(tmp_path, TWO)
    held = knowing(evidence, counter="Mug|1", bed="", desk="").moved(LocationId(COUNTER)).picked(item("Mug|1"))
    assert not needed_in(evidence).one_plan_is_best(held)
    assert needed_in(evidence).one_plan_is_best(held.seen(TABLE, ()))


def test_plans_of_equal_cost_that_begin_otherwise_are_told(tmp_path: Path) -> None:
    """Through the hub only the end counts: the mug is brought last, to the fridge, and the pencil may be sought
    before the book or after it. Once the pencil is known there is nothing to choose before a look."""
    goal = AllOf(parts=(delivered(MUG, FRIDGE), delivered(BOOK, COUNTER), delivered(PENCIL, START)))
    evidence = toy_evidence(tmp_path, task_of(goal))
    through_hub = with_radii(evidence)
    known = knowing(evidence, bed="Mug|2", desk="Book|2", counter="")
    assert not needed_in(through_hub).one_plan_is_best(known)
    assert needed_in(through_hub).one_plan_is_best(known.seen(TABLE, (item("Pencil|1"),)))
    assert needed_in(evidence).one_plan_is_best(known)


def bound_from_everywhere(items: NeededItems, evidence: Evidence, known: Knowledge) -> Floats:
    """Of the mug, which is the first part; the pencil is missing."""
    index = evidence.place.travel.index
    at = np.array([index(place) for place, _ in known.where(MUG)])
    left = np.array([index(LocationId(c)) for c in known.unsearched], dtype=np.intp)
    looked = np.array([index(LocationId(c)) for c in evidence.open if c in known.first_seen], dtype=np.intp)
    bound = np.empty(len(evidence.place.travel.locations))
    fill_everywhere(bound, items.rules, 0, index(known.robot_at), at, left, looked, True)
    return bound


def test_by_hand_from_everywhere_no_item_is_nearer_than_the_bound(tmp_path: Path) -> None:
    """The mug in the bed is not needed, but from the bed it is the nearest; the desk was not opened while recording,
    and may hold another mug that is not needed."""
    evidence = with_radii(toy_evidence(tmp_path, TWO))
    items, known = needed_in(evidence), knowing(evidence, counter="Mug|1", bed="Mug|2")
    assert containers_of(items, MUG, known) == [COUNTER]
    names = evidence.place.travel.locations
    bound = dict(zip(names, bound_from_everywhere(items, evidence, known), strict=True))
    assert bound[LocationId(BED)] == metres_along(evidence, BED, START)
    assert bound[LocationId(FRIDGE)] == metres_along(evidence, FRIDGE, COUNTER, START)
    assert DESK in evidence.open
    looked = bound_from_everywhere(items, evidence, known.seen(DESK, ()))
    assert looked[names.index(LocationId(DESK))] == metres_along(evidence, DESK, START)


def test_where_a_third_place_shortens_a_path_all_items_are_needed(tmp_path: Path) -> None:
    evidence = toy_evidence(tmp_path, TWO)
    assert needed_items(evidence, NearestFirst()) is not None
    assert needed_items(evidence, None) is None
    metres = np.array(evidence.place.travel.metres)
    metres[0, 1] = metres[1, 0] = 50.0
    travel = TravelCosts(locations=evidence.place.travel.locations, metres=metres)
    assert needed_items(replace(evidence, place=replace(evidence.place, travel=travel)), NearestFirst()) is None
    assert needed_items(replace(evidence, misses=1), NearestFirst()) is None
    assert needed_items(replace(evidence, refused_searches={BED: "stuck"}), NearestFirst()) is None


@pytest.mark.parametrize("name", ["opt-greedy", "opt-lios"])
def test_in_any_world_the_run_is_that_of_the_strategy(prepared: PreparedLog, name: str) -> None:
    """Worlds in which many containers hold what is sought; each run of the tree against the closed loop's own."""
    tree, chance = run_tree_of(prepared, strategy(name)), random.Random(22)

    def full(unobserved: UnobservedLook) -> tuple[ItemType, ...]:
        return max(chance.sample(unobserved.options, min(2, len(unobserved.options))), key=len)

    leaves = [tree.follow(full) for _ in range(150)]
    assert not tree.ambiguous
    assert tree.segments < sum(len(leaf.filled) for leaf in leaves)
    for leaf in leaves[-25:]:
        *_, ended = tree.events(leaf, explained_by=strategy(name))
        assert isinstance(ended, RunEnded)
        assert abs(ended.cost - leaf.cost) < NEAR_COST


def test_both_ends_of_a_delivery_are_reached_with_a_fraction_of_the_runs(prepared: PreparedLog) -> None:
    """With all items told apart, 551 segments leave an upper bound of 283.1."""
    tree = run_tree_of(prepared, strategy("opt-greedy"))
    found = search_worlds(tree, None, DEFAULT_BUDGET.of(plans_shortest=True), SearchCache())
    assert (found.bounds.lower, found.bounds.upper) == pytest.approx((72.4132, 190.8656), abs=1e-4)
    assert (found.bounds.lower_proof, found.bounds.upper_proof) == (Proof.EXACT, Proof.EXACT)
    assert found.segments < 200


def test_an_ambiguous_run_is_followed_with_all_items(prepared: PreparedLog, monkeypatch: pytest.MonkeyPatch) -> None:
    """Were every plan one of several equally good ones, all would be as if no items were left out."""

    def never(_items: NeededItems, *_state: object) -> bool:
        return False

    monkeypatch.setattr(NeededItems, "one_plan_is_best", never)
    monkeypatch.setattr(NeededItems, "one_plan_is_best_at", never)
    tree, budget = run_tree_of(prepared, strategy("opt-greedy")), Budget(segments=30, finish=0)
    apart = run_tree_of(prepared, strategy("opt-greedy")).with_all_items()
    assert bounds_of(tree, budget=budget).figures == bounds_of(apart, budget=budget).figures
    assert tree.ambiguous
    assert not apart.ambiguous
    assert tree.segments > apart.segments
    assert tree.asked == apart.asked
    for answers in (min, max):
        ends = [made.follow(lambda look, choose=answers: choose(look.options, key=len)) for made in (tree, apart)]
        assert ends[0] == ends[1]
