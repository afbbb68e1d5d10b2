"""Renders one moment of runs as a PNG."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dashboards.model.timeline import Timeline
from dashboards.rendering.chromium import page_of
from workbench.errors import BadValue, OutputExists

MAX_PX = 4096
USUAL_PX = (1280, 720)
"""The picture size for which text sizes are designed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Framing:
    """Size and walls of the picture.

    Raises:
        BadValue: a size that is not between 64 and MAX_PX, or walls of another kind.
    """

    width: int = 1280
    height: int = 720
    from_above: bool = False
    follow: bool = False
    walls: str = "cut"
    caption: bool = True

    def __post_init__(self) -> None:
        for name, value in (("width", self.width), ("height", self.height)):
            if not 64 <= value <= MAX_PX:
                raise BadValue(f"--{name}", value, f"from 64 to {MAX_PX} pixels")
        if self.walls not in ("cut", "whole", "none"):
            raise BadValue("--walls", self.walls, "cut, whole or none")

    @property
    def scale(self) -> float:
        """Device pixels per CSS pixel: a larger picture has larger text, not more space around it.

        In quarters, and so that both sides are whole CSS pixels.
        """
        room = min(self.width / USUAL_PX[0], self.height / USUAL_PX[1])
        quarters = [q / 4 for q in range(int(4 * room), 4, -1)]
        return next((s for s in quarters if not self.width % s and not self.height % s), 1.0)

    @property
    def options(self) -> dict[str, bool]:
        """Arguments of the page's `lios.bare`."""
        return {"caption": self.caption, "above": self.from_above}


def draw_picture(
    timelines: Sequence[Timeline], path: Path, *, at_s: float, framing: Framing, force: bool = False
) -> None:
    """Writes the picture of a moment.

    Args:
        at_s: seconds after the start.

    Raises:
        OutputExists: the file is there and force is not given.
        BadValue: a moment before the start.
        MissingExtra, NoChromium, PageFailed: there is nothing to draw with.
    """
    if path.exists() and not force:
        raise OutputExists(path)
    if not at_s >= 0:
        raise BadValue("--at", at_s, "seconds after the start, at least 0")
    with page_of(timelines, width=framing.width, height=framing.height, scale=framing.scale) as page:
        page.evaluate("(o) => window.lios.bare(o)", framing.options)
        page.evaluate("(w) => window.lios.walls(w)", framing.walls)
        page.evaluate("(f) => window.lios.follow(f)", framing.follow)
        page.evaluate("(t) => window.lios.seek(t)", at_s)
        page.wait_for_timeout(150)
        picture = page.screenshot(type="png")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(picture)
