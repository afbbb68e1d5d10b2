"""Large, sparse and strange logs: a thousand item types, no map, no beliefs, rooms without walls."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from toy import toy_plan
from toy_run import empty_run, ns, toy_place, toy_run

from dashboards.capsule.run_data import MAX_ITEMS, items_of
from dashboards.capsule.write import capsule_page
from dashboards.figures.files import write_figures
from dashboards.geometry.house import house_shape
from dashboards.model.clock import Clock
from dashboards.model.first_stop_costs import first_looks
from dashboards.model.scene import scene_at
from dashboards.model.timeline import Timeline, timeline_of
from dashboards.panels.beliefs import beliefs
from dashboards.panels.find_costs import MAX_ROWS, find_costs
from dashboards.panels.plots import plots
from replayers.runs.run import Run
from workbench.log_schema.events import FindCosts

TYPES = tuple(f"Thing{i:04d}" for i in range(1000))


def thousand_types() -> Run:
    """The toy run, believing and pricing a thousand item types besides the mug."""
    ours = toy_run()
    rng = np.random.default_rng(0)
    wide = tuple(
        replace_struct(
            belief,
            item_types=("Mug", *TYPES),
            probability=(
                belief.probability[0],
                *(tuple(float(v) for v in rng.uniform(0, 0.3, len(belief.containers))) for _ in TYPES),
            ),
        )
        for belief in ours.beliefs
    )
    priced = ours.find_costs[0]
    costs = FindCosts(
        stamp=priced.stamp,
        decision=priced.decision,
        item_types=("Mug", *TYPES),
        origins=priced.origins,
        targets=priced.targets,
        metres=(priced.metres[0], *(((9.0, 15.0), (8.0, 16.0)) for _ in TYPES)),
        kind="model",
        belief_model="exists",
    )
    return replace(ours, beliefs=wide, find_costs=(costs,))


def replace_struct(struct: object, **changes: object) -> object:
    import msgspec

    return msgspec.structs.replace(struct, **changes)  # type: ignore[type-var]


@pytest.fixture(scope="module")
def many() -> Timeline:
    return timeline_of(thousand_types())


def test_a_thousand_item_types_are_shown_in_the_time_of_a_frame(many: Timeline) -> None:
    assert len(many.item_types) == 1001
    began = time.thread_time()
    for second in (0.0, 4.5, 9.0):
        scene = scene_at(many, ns(second), focus="Thing0007")
        assert scene.focus == "Thing0007"
        assert beliefs(scene, many)
    assert time.thread_time() - began < 2.0, "of this thread alone, whatever else the machine does"
    table = find_costs(scene_at(many, ns(1)), "start", first_looks(many, many.decisions[0]))
    assert table.count("<tr>") < MAX_ROWS + 20
    assert "and 1802 more" in table
    assert plots(Clock(timelines=(many,)), ["lios"], "Thing0007").count("<svg") == 3


def test_a_page_of_a_thousand_item_types_offers_some_and_stays_small(many: Timeline) -> None:
    assert items_of(many)[0] == "Mug", "the goal's first"
    assert len(items_of(many)) == MAX_ITEMS
    assert len(capsule_page([many])) < 400_000


@pytest.mark.ci
def test_a_place_without_a_map_is_shown(tmp_path: Path) -> None:
    place = toy_place()
    assert place.occupancy is None
    bare = replace(place, plan=replace(toy_plan(), walls=(), doors=(), windows=(), furniture=()))
    timeline = timeline_of(replace(toy_run(), place=bare))
    assert timeline.plan is not None
    assert house_shape(timeline.plan).cut_walls == ()
    assert len(scene_at(timeline, ns(9)).trail) > 2
    assert capsule_page([timeline])
    assert write_figures([timeline], tmp_path, formats=("svg",))


def test_a_log_without_beliefs_has_figures_and_a_page(tmp_path: Path) -> None:
    timeline = timeline_of(replace(toy_run(), beliefs=(), find_costs=()))
    scene = scene_at(timeline, ns(1))
    assert scene.focus == ""
    assert np.isnan(scene.belief).all()
    assert first_looks(timeline, timeline.decisions[0]) == ()
    assert capsule_page([timeline])
    written = write_figures([timeline], tmp_path, formats=("svg",))
    assert not any("belief" in path.name for path in written)


def test_a_log_cut_off_at_once_has_figures(tmp_path: Path) -> None:
    assert write_figures([timeline_of(empty_run())], tmp_path, formats=("svg",))
