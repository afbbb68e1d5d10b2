"""Renders one moment of runs as a PNG."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dashboards.library.same_place import same_house
from dashboards.model.timeline import Timeline
from dashboards.rendering.chromium import page_of
from workbench.errors import BadValue, OutputExists
from workbench.files import make_folder, write_atomically
from workbench.tolerances import NEAR_SHOWN_S

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


def require_within(timelines: Sequence[Timeline], at_s: float, *, option: str) -> None:
    """Refuses a moment at which no run that is drawn goes on.

    Raises:
        BadValue: it is before the start, or after the end of the longest run.
    """
    lasts_s = max(timeline.duration_s for timeline in same_house(timelines))
    if not 0 <= at_s <= lasts_s + NEAR_SHOWN_S:
        raise BadValue(option, f"{at_s:g}", f"within the runs, 0 to {lasts_s:.1f} seconds")


def draw_picture(
    timelines: Sequence[Timeline], path: Path, *, at_s: float, framing: Framing, force: bool = False
) -> None:
    """Writes the picture of a moment.

    Args:
        at_s: seconds after the start.

    Raises:
        OutputExists: the file is there and force is not given.
        BadValue: a moment before the start, or after the end of all runs.
        MissingExtra, NoChromium, PageFailed: there is nothing to draw with.
    """
    if path.exists() and not force:
        raise OutputExists(path)
    require_within(timelines, at_s, option="--at")
    with page_of(timelines, width=framing.width, height=framing.height, scale=framing.scale) as page:
        page.evaluate("(o) => window.lios.bare(o)", framing.options)
        page.evaluate("(w) => window.lios.walls(w)", framing.walls)
        page.evaluate("(f) => window.lios.follow(f)", framing.follow)
        page.evaluate("(t) => window.lios.seek(t)", at_s)
        page.wait_for_timeout(150)
        picture = page.screenshot(type="png")
    make_folder(path.parent)
    write_atomically(path, picture)
