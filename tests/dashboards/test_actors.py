"""Name tags of robots in the view: shown for those that stand alone, where several runs are of the place."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from toy_run import ns, other_run, toy_run

from dashboards.model.scene import scene_at
from dashboards.model.timeline import timeline_of
from dashboards.panels.now import RunLegend, legend
from dashboards.viser_app.drawing.actors import Actors

OURS, OTHER = timeline_of(toy_run()), timeline_of(other_run())


class Stand:
    """As much of a Viser scene as actors need; remembers its labels and its other objects."""

    def __init__(self) -> None:
        self.labels: list[Any] = []
        self.nodes: dict[str, Any] = {}

    def _node(self, name: str, *_: object, visible: bool = True, **__: object) -> Any:
        self.nodes[name] = SimpleNamespace(visible=visible, remove=lambda: self.nodes.pop(name))
        return self.nodes[name]

    add_batched_meshes_simple = add_line_segments = _node

    def add_label(self, _name: str, text: str, **given: Any) -> Any:
        self.labels.append(SimpleNamespace(text=text, visible=given["visible"], remove=lambda: None))
        return self.labels[-1]


def named(second: float, *, runs: int = 2, here: bool = True, numbered: tuple[tuple[float, float], ...] = ()) -> list:
    stand = Stand()
    actors = Actors(stand)  # type: ignore[arg-type]
    actors.set_runs([(0, 0, 0), (9, 9, 9)][:runs], ["ours", "other"][:runs], [True, here][:runs])
    actors.show([scene_at(OURS, ns(second)), scene_at(OTHER, ns(second))][:runs], numbered)
    return [label.text for label in stand.labels if label.visible]


def test_a_run_alone_needs_no_name() -> None:
    assert named(14.0, runs=1) == []


def test_robots_that_stand_together_have_one_name() -> None:
    """Until 4 s both do the same; then one goes for the counter, one for the bed."""
    assert named(1.0) == ["ours"]
    assert named(8.0) == ["ours", "other"]


def test_ghosts_that_stand_together_share_a_tag() -> None:
    """At 8 s the two others stand at one place, ours elsewhere; a fourth and fifth would not fit the tag."""
    ghost = scene_at(OTHER, ns(8.0))
    stand = Stand()
    actors = Actors(stand)  # type: ignore[arg-type]
    actors.set_runs([(0, 0, 0)] * 5, ["ours", "a", "b", "c", "d"], [True] * 5)
    actors.show([scene_at(OURS, ns(8.0)), ghost, ghost, ghost, ghost], ())
    assert [label.text for label in stand.labels if label.visible] == ["ours", "a, b, c ..."]
    actors.show([scene_at(OURS, ns(8.0)), ghost, scene_at(OURS, ns(8.0)), ghost, ghost], ())
    assert [label.text for label in stand.labels if label.visible] == ["ours", "a, c, d"]


def test_a_number_goes_before_the_name_of_the_robot_beside_it() -> None:
    robot = scene_at(OURS, ns(8.0)).robot
    assert named(8.0, numbered=((robot.x_m + 0.5, robot.y_m),)) == ["other"]


def test_a_run_of_another_place_is_not_named() -> None:
    assert named(8.0, here=False) == ["ours"]


def test_the_legend_tells_of_a_mark_that_a_ghost_left() -> None:
    scene = scene_at(OURS, ns(5.5))
    assert not scene.unseen.any()
    assert isinstance(scene.unseen, np.ndarray)
    assert "◆" not in legend(scene)
    assert "◆" in legend(scene, RunLegend(ended=True))


def test_however_many_ghosts_are_three_objects_in_their_colours() -> None:
    ghost, apart = scene_at(OTHER, ns(8.0)), scene_at(OTHER, ns(7.0))
    stand = Stand()
    actors = Actors(stand)  # type: ignore[arg-type]
    for count in (2, 20):
        actors.set_runs([(255, 0, 0), *[(0, 0, 255)] * (count - 1)], ["run"] * count, [True] * count)
        assert len(stand.nodes) == 7
    actors.show([scene_at(OURS, ns(8.0)), ghost, apart], ())
    bodies, trails = stand.nodes["/runs/ghosts/bodies"], stand.nodes["/runs/ghosts/trails"]
    assert np.allclose(bodies.batched_positions[0, :2], (ghost.robot.x_m, ghost.robot.y_m))
    assert bodies.batched_colors.tolist() == [[0, 0, 255]] * 2
    assert len(trails.batched_positions) == len(trails.batched_colors) > 0
    assert len(stand.nodes["/runs/focus/bodies"].batched_positions) == 1


def test_ghosts_that_would_be_drawn_through_another_robot_are_not_drawn() -> None:
    """At 8 s ours stands elsewhere than the two others; where one of those is in focus, no ghost is left but ours."""
    ours, ghost = scene_at(OURS, ns(8.0)), scene_at(OTHER, ns(8.0))
    stand = Stand()
    actors = Actors(stand)  # type: ignore[arg-type]
    actors.set_runs([(0, 0, 0), (1, 1, 1), (2, 2, 2)], ["a", "b", "c"], [True] * 3)
    bodies, trails = (stand.nodes[f"/runs/ghosts/{name}"] for name in ("bodies", "trails"))
    actors.show([ours, ghost, ghost], ())
    alone = len(trails.batched_positions)
    assert len(bodies.batched_positions) == 1
    actors.set_runs([(0, 0, 0), (1, 1, 1)], ["a", "b"], [True] * 2)
    bodies, trails = (stand.nodes[f"/runs/ghosts/{name}"] for name in ("bodies", "trails"))
    actors.show([ours, ghost], ())
    assert len(trails.batched_positions) == alone, "a path that another hides is not drawn"
    actors.show([ghost, ghost], ())
    assert not bodies.visible
    actors.show([ghost, ours], ())
    assert bodies.visible


def test_tags_of_more_runs_than_there_are_colours_are_their_numbers() -> None:
    stand = Stand()
    actors = Actors(stand)  # type: ignore[arg-type]
    actors.set_runs([(0, 0, 0)] * 12, [f"a long name {i}" for i in range(12)], [True] * 12)
    actors.show([scene_at(OURS, ns(8.0)), *[scene_at(OTHER, ns(8.0))] * 11], ())
    assert [label.text for label in stand.labels if label.visible] == ["run 1", "runs 2, 3, 4 ..."]


def test_a_run_of_another_place_is_not_drawn() -> None:
    stand = Stand()
    actors = Actors(stand)  # type: ignore[arg-type]
    actors.set_runs([(0, 0, 0), (9, 9, 9)], ["ours", "other"], [True, False])
    actors.show([scene_at(OURS, ns(8.0)), scene_at(OTHER, ns(8.0))], ())
    assert not stand.nodes["/runs/ghosts/bodies"].visible
    assert not stand.nodes["/runs/ghosts/trails"].visible
    assert stand.nodes["/runs/focus/bodies"].visible
