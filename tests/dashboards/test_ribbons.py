"""Paths as ribbons: as long as their segments, turned along them, dashed together, and none of them twice."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from dashboards.geometry.marks import dashed, dashes, robot_body, robot_ghost, robot_legs, segments, uncovered
from dashboards.viser_app.drawing.ribbons import Ribbons

WAY = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0], [0.0, 0.0]])


def shown(points: Any) -> Any:
    made = SimpleNamespace(remove=lambda: None)
    stand = SimpleNamespace(add_batched_meshes_simple=lambda *_, visible, **__: made)
    Ribbons(stand, "/way", 0.1).show(points, np.zeros((len(points), 3), dtype=np.uint8))  # type: ignore[arg-type]
    return made


def test_a_ribbon_covers_its_segment() -> None:
    lines = segments(WAY, 0.2)
    made = shown(lines)
    assert np.allclose(made.batched_scales, [[3.1, 0.1, 1], [4.1, 0.1, 1], [5.1, 0.1, 1]])
    assert np.allclose(made.batched_positions, [[1.5, 0, 0.2], [3, 2, 0.2], [1.5, 2, 0.2]])
    w, z = made.batched_wxyzs[:, 0], made.batched_wxyzs[:, 3]
    along = np.column_stack([w * w - z * z, 2 * w * z])
    assert np.allclose(along, [[1, 0], [0, 1], [-0.6, -0.8]], atol=1e-6)


def test_no_segments_are_hidden() -> None:
    assert not shown(np.zeros((0, 2, 3), dtype=np.float32)).visible


def test_of_segments_on_one_another_the_first_is_drawn() -> None:
    there, back = segments(WAY, 0.2), segments(WAY[::-1], 0.1)
    assert uncovered(np.concatenate([there, back, there + np.float32(0.3)])).tolist() == [0, 1, 2, 6, 7, 8]
    assert uncovered(there[:0]).tolist() == []


def test_paths_are_dashed_together_as_each_alone() -> None:
    first, second = segments(WAY, 0.1), segments(WAY + 0.05, 0.3)
    together, of_line = dashed(np.concatenate([first, second]))
    assert np.allclose(together[of_line < 3], dashes(WAY, 0.1), atol=1e-5)
    assert np.allclose(together[of_line >= 3], dashes(WAY + 0.05, 0.3), atol=1e-5)


def test_a_ghost_has_a_third_of_the_faces_of_a_robot() -> None:
    assert 3 * len(robot_ghost()[1]) <= len(robot_body()[1]) + len(robot_legs()[1])
    assert np.allclose(robot_ghost()[0][:, 2].min(), robot_legs()[0][:, 2].min(), atol=0.03)
