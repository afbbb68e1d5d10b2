"""The sight of a run, as its log tells it: the field of view, and the viewpoints of what was seen in passing."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from unittest.mock import Mock, create_autospec

import msgspec
import numpy as np
import pytest
import viser
from toy import COUNTER, TABLE, toy_plan
from toy_run import ns, toy_run

from dashboards.geometry.sight_marks import DOTS_APART_M, dots_between, eye, field_mesh
from dashboards.model.labels import action_words, humanize_ids
from dashboards.model.perception.sight import field_of, seen_in_passing, sight_outline
from dashboards.model.scene import scene_at
from dashboards.model.timeline import Timeline, timeline_of
from dashboards.panels.beliefs import beliefs
from dashboards.panels.now import legend, run_signs
from dashboards.viser_app.drawing.sight_layer import SightLayer
from workbench.log_schema.events import SeenInPassing

INDEX = {c.id: i for i, c in enumerate(toy_plan().containers)}


def passing(radius_m: object = 1.5) -> Timeline:
    """The toy run with a sight of 1.5 m, in which the counter was seen in passing at 7 s from (2, 2.4), and the table
    from where the robot started."""
    run = toy_run()
    viewpoints = {COUNTER: (2.0, 2.4, 0.0), TABLE: (1.0, 2.0, 0.0)}
    observations = tuple(
        msgspec.structs.replace(o, passing=SeenInPassing(viewpoint=viewpoints[o.container]))  # type: ignore[index]
        if o.container in viewpoints
        else o
        for o in run.observations
    )
    settings = MappingProxyType({**run.settings, "sight": {"radius_m": radius_m}})
    return timeline_of(replace(run, observations=observations, settings=settings))


def test_the_field_of_view_reaches_as_far_as_the_log_says() -> None:
    outline = sight_outline(passing(), (2.0, 2.0))
    assert outline is not None
    assert np.hypot(*(outline - [2.0, 2.0]).T).max() == pytest.approx(1.5)


@pytest.mark.parametrize("radius_m", ["far", -1.0, 1e9])
def test_a_damaged_radius_is_no_sight(radius_m: object) -> None:
    assert field_of(passing(radius_m)) is None


def test_what_was_seen_in_passing_appears_at_its_moment_with_its_viewpoint() -> None:
    timeline = passing()
    (table,) = seen_in_passing(timeline, ns(6.9))
    assert (table.container, table.viewpoint) == (INDEX[TABLE], (1.0, 2.0))
    _, counter = seen_in_passing(timeline, ns(7.0))
    assert (counter.container, counter.viewpoint) == (INDEX[COUNTER], (2.0, 2.4))


def test_the_dashboard_draws_the_field_and_what_was_seen_and_hides_them() -> None:
    """As the dashboard calls Viser; how it looks in a browser is for test_sight_in_chromium."""
    parts: dict[str, Mock] = {}
    view = create_autospec(viser.SceneApi, instance=True)
    for add in (view.add_mesh_simple, view.add_line_segments, view.add_batched_meshes_simple):
        add.side_effect = lambda name, *_, visible=True, **__: parts.setdefault(name, Mock(visible=visible))
    timeline, layer = passing(), SightLayer(view)
    layer.open([(1.0, 1.0, 1.0)] * len(INDEX))
    early, late = scene_at(timeline, ns(1.0)), scene_at(timeline, ns(8.0))
    seen: list[tuple[set[str], int]] = []
    for scene, visible in ((early, True), (late, True), (late, False), (late, True)):
        layer.show(timeline, scene, visible=visible)
        shown = {name.removeprefix("/sight/") for name, part in parts.items() if part.visible}
        seen.append((shown, len(parts["/sight/eyes"].batched_positions)))
    everything = {"field", "outline", "eyes", "dots"}
    assert seen == [(everything, 1), (everything, 2), (set(), 2), (everything, 2)]
    outline = sight_outline(timeline, (late.robot.x_m, late.robot.y_m))
    assert outline is not None
    assert parts["/sight/outline"].points[:, 0, :2] == pytest.approx(outline, abs=1e-5)


def test_what_was_seen_in_passing_is_not_counted_as_searched() -> None:
    timeline = passing()
    assert scene_at(timeline, ns(15)).searches == 1
    assert "× seen in passing" in beliefs(scene_at(timeline, ns(15), focus="Plate"), timeline)


def test_a_run_without_sight_has_none_of_it() -> None:
    timeline = timeline_of(toy_run())
    assert sight_outline(timeline, (2.0, 2.0)) is None
    assert seen_in_passing(timeline, timeline.end_ns) == ()
    words = legend(scene_at(timeline, ns(8)), run_signs([timeline]))
    assert "sees so far" not in words
    assert "seen in passing" not in words


def test_the_legend_names_both_signs() -> None:
    timeline = passing()
    words = legend(scene_at(timeline, ns(8)), run_signs([timeline]))
    assert "sees so far" in words
    assert "seen in passing" in words


def test_marks_by_hand() -> None:
    """Three dots on a line of 0.79 m; the fan of a square faces up and covers it."""
    dots = dots_between(np.zeros(3), np.array([0.0, 0.79, 0.0]))
    assert dots[:, 1] == pytest.approx([0.79 / 4, 0.79 / 2, 0.79 * 3 / 4])
    assert np.diff(dots[:, 1]).max() <= DOTS_APART_M
    points, faces = field_mesh((1.0, 1.0), np.array([[2.0, 1.0], [1.0, 2.0], [0.0, 1.0], [1.0, 0.0]]))
    sides = points[faces]
    areas = np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0])[:, 2] / 2
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(2.0)
    lids, triangles = eye()
    assert triangles.max() < len(lids)


def test_a_stop_on_the_way_is_named_by_its_coordinates():
    words = "a stop on the way at (2.65 m, -3.85 m)"
    assert action_words("move", (), "on the way|2.650|-3.850") == f"move to {words}"
    assert humanize_ids("went on the way|2.650|-3.850.") == f"went {words}."
