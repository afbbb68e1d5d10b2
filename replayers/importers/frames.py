"""Transforms between the frames of a bag, chained from the newest tf messages; static ones do not age."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, final

import numpy as np

from workbench.arrays import Floats
from workbench.tolerances import DEGENERATE

MAX_CHAIN = 50


@final
@dataclass(slots=True)
class FrameBuffer:
    """Child frames with their parent and the transform between them."""

    _links: dict[str, tuple[str, Floats]] = field(default_factory=dict)
    _stamps: dict[str, int] = field(default_factory=dict)

    def add(self, parent: str, child: str, transform: Any, *, stamp_ns: int | None = None) -> None:
        """Takes a geometry_msgs/Transform; without a stamp it is static."""
        if stamp_ns is not None:
            self._stamps[plain(child)] = stamp_ns
        self._links[plain(child)] = (plain(parent), matrix_of(transform.translation, transform.rotation))

    def set(self, parent: str, child: str, parent_tform_child: Floats) -> None:
        """Takes a transform as a matrix, shape (4, 4)."""
        self._links[child] = (parent, parent_tform_child)

    def parent_of(self, child: str) -> tuple[str, Floats]:
        """A frame's parent and parent_tform_child. Raises KeyError for a frame without one."""
        return self._links[child]

    @property
    def names(self) -> frozenset[str]:
        """All known frames."""
        return frozenset(self._links) | {parent for parent, _ in self._links.values()}

    def named(self, name: str) -> str:
        """A frame by its name, or the only one that has a robot's name before it: spot/body for body.

        Drivers put the name of their robot before every frame when they are given one. Unchanged when there is
        no such frame, or several.
        """
        own = plain(name)
        if own in self.names:
            return own
        longer = sorted(frame for frame in self.names if frame.endswith(f"/{own}"))
        return longer[0] if len(longer) == 1 else own

    def lookup(self, target: str, source: str) -> Floats | None:
        """target_tform_source, shape (4, 4), metres; None when no chain connects the two."""
        to_target, to_source = self._chain(plain(target)), self._chain(plain(source))
        for frame, from_source in to_source.items():
            if frame in to_target:
                return np.linalg.inv(to_target[frame]) @ from_source
        return None

    def links(self) -> list[tuple[str, str, Floats]]:
        """(parent, child, parent_tform_child) of everything known, by child."""
        return [(parent, child, transform) for child, (parent, transform) in sorted(self._links.items())]

    def age_ns(self, frame: str, stamp_ns: int) -> int:
        """How much older than a time the oldest transform above a frame is; 0 where all are static or newer."""
        return max(
            [0, *(stamp_ns - self._stamps[name] for name in self._chain(plain(frame)) if name in self._stamps)]
        )

    def _chain(self, frame: str) -> dict[str, Floats]:
        """Every ancestor of a frame with ancestor_tform_frame, the frame itself first."""
        chain, at, total = {frame: np.eye(4)}, frame, np.eye(4)
        while at in self._links and len(chain) < MAX_CHAIN:
            at, transform = self._links[at][0], self._links[at][1]
            total = transform @ total
            if at in chain:
                break
            chain[at] = total
        return chain


def plain(frame: str) -> str:
    """A frame's name without its leading slash."""
    return frame.lstrip("/")


def matrix_of(position: Any, rotation: Any) -> Floats:
    """A pose as a homogeneous matrix, shape (4, 4); a zero quaternion counts as none."""
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    size = x * x + y * y + z * z + w * w
    s = 2.0 / size if size > DEGENERATE else 0.0
    turned = np.array(
        [
            [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
            [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
            [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turned, (position.x, position.y, position.z)
    return matrix


def quaternion_of(matrix: Floats) -> tuple[float, float, float, float]:
    """The rotation of a matrix as (x, y, z, w), by Shepperd's method: the largest of the four is divided by."""
    m = matrix[:3, :3]
    squares = (*(1 + 2 * np.diag(m) - np.trace(m)), 1 + np.trace(m))  # four times x^2, y^2, z^2, w^2
    largest = int(np.argmax(squares))
    crossed = (m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1])  # four times wx, wy, wz
    if largest == 3:
        four = [*crossed, squares[3]]
    else:
        four = [*(m[largest] + m[:, largest]), crossed[largest]]
        four[largest] = squares[largest]
    x, y, z, w = np.array(four) / np.linalg.norm(four)
    return float(x), float(y), float(z), float(w)
