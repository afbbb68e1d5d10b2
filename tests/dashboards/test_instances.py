"""Copies of a mesh: only the wanted ones are drawn, none is hidden, and more than expected find room."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from dashboards.geometry.solids import unit_mesh
from dashboards.viser_app.drawing.instances import Instances


class Stand:
    """As much of a Viser scene as instances need; remembers what is in it."""

    def __init__(self) -> None:
        self.there: list[Any] = []

    def add_batched_meshes_simple(self, *given: Any, visible: bool, **_: object) -> Any:
        made = SimpleNamespace(visible=visible, room=len(given[4]), remove=lambda: self.there.remove(made))
        self.there.append(made)
        return made


def shown(copies: Instances, count: int) -> None:
    copies.show(np.zeros((count, 3), dtype=np.float32), np.zeros((count, 3), dtype=np.uint8))


def test_none_is_hidden_and_some_are_as_many_as_wanted() -> None:
    stand = Stand()
    copies = Instances(stand, "/marks", unit_mesh("box"), capacity=5)  # type: ignore[arg-type]
    (mesh,) = stand.there
    assert (mesh.room, mesh.visible) == (5, False)
    shown(copies, 2)
    assert (len(mesh.batched_positions), len(mesh.batched_wxyzs), mesh.visible) == (2, 2, True)
    shown(copies, 0)
    assert not mesh.visible


def test_more_than_expected_find_room() -> None:
    stand = Stand()
    copies = Instances(stand, "/marks", unit_mesh("box"), capacity=0)  # type: ignore[arg-type]
    shown(copies, 1)
    shown(copies, 9)
    (mesh,) = stand.there
    assert (mesh.room, len(mesh.batched_positions), mesh.visible) == (16, 9, True)
    copies.remove()
    assert stand.there == []
