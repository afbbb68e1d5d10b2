"""A browser's camera that shows the whole house, in a picture of any shape, until somebody moves it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import viser

from dashboards.geometry.house import HouseShape
from dashboards.viser_app.cameras import CameraPose, fitted, look
from workbench.arrays import Floats

UNMOVED_M = 0.02
MAX_HISTORY = 8
MAX_LATE_FITS = 5
USUAL_ASPECT, MIN_ASPECT = 1.6, 0.4
"""Width over height of a picture whose size is not known yet, and of the narrowest that a house is fitted to."""


class FittedCamera:
    """The camera of one browser.

    Args:
        shape: the house on show; None while there is none.
    """

    def __init__(self, client: viser.ClientHandle, shape: Callable[[], HouseShape | None]) -> None:
        self._client = client
        self._shape = shape
        self._fitted: tuple[bool, CameraPose] | None = None
        self._placed: list[tuple[float, ...]] = []
        """Poses set by the server that a browser may still report."""
        self._late_fits = 0

    def begin(self) -> None:
        """The browser has arrived, with the camera that the server gave it."""
        self._placed.append(tuple(self._client.camera.position))

    def fit(self, *, from_above: bool = False) -> None:
        """Shows the whole house."""
        pose = self.pose(from_above=from_above)
        if pose is not None:
            self._fitted = (from_above, pose)
            self._placed = [*self._placed[1 - MAX_HISTORY :], pose.position]
            look(self._client, pose)

    def refit(self, *, late: bool = False) -> None:
        """Fits the house to a picture of another shape, if nobody has moved the camera since it was fitted.

        A browser's report of its camera may be older than the last pose sent to it: it then equals an earlier pose.

        Args:
            late: the view has settled, so that the camera should be where it was put.
        """
        if self._fitted is None:
            return
        from_above, _ = self._fitted
        at, pose = self._client.camera.position, self.pose(from_above=from_above)
        self._late_fits = self._late_fits if late else 0
        if pose is None or _is_near(at, pose.position) or self._late_fits >= MAX_LATE_FITS:
            return
        if any(_is_near(at, place) for place in self._placed):
            self._late_fits += late
            self.fit(from_above=from_above)

    def look_away(self, pose: CameraPose) -> None:
        """Shows something else than the whole house."""
        self._fitted = None
        look(self._client, pose)

    def pose(self, *, from_above: bool = False) -> CameraPose | None:
        """A pose that fits the house into the browser's window; None while nothing is shown."""
        shape = self._shape()
        if shape is None:
            return None
        wide, high = self._client.camera.image_width, self._client.camera.image_height
        aspect = max(MIN_ASPECT, wide / high) if high else USUAL_ASPECT
        return fitted(shape, from_above=from_above, aspect=aspect)


def _is_near(place: Sequence[float] | Floats, other: Sequence[float]) -> bool:
    return np.allclose(place, other, atol=UNMOVED_M)
