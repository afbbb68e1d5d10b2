"""Renders runs as an MP4 video: the page draws each moment, and Chromium's own encoder makes H.264 of it.

No other program is needed. Videos always run on the clock of time.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dashboards.library.same_place import same_house
from dashboards.model.timeline import Timeline
from dashboards.rendering.chromium import PageFailed, page_of
from dashboards.rendering.mp4 import Sample, mp4
from dashboards.rendering.picture import Framing, require_within
from workbench.errors import BadValue, OutputExists
from workbench.files import make_folder, write_atomically
from workbench.terminal import progress

CAPTION_LINE_PX = 19
"""Height of a line of a video's caption: its title, its moment, and one for each run."""
FRAMES_PER_CALL = 12
"""Frames that the page draws between two answers."""


def draw_video(
    timelines: Sequence[Timeline],
    path: Path,
    *,
    framing: Framing,
    from_s: float = 0.0,
    until_s: float | None = None,
    speed: float = 4.0,
    frames_a_second: int = 24,
    force: bool = False,
) -> int:
    """Writes the video; returns its number of frames.

    Args:
        from_s, until_s: the part of the runs, in seconds after the start; None is the end of the longest.
        speed: seconds of the runs in one second of the video.

    Raises:
        OutputExists: the file is there and force is not given.
        BadValue: an empty part, a speed or frame rate out of range.
        MissingExtra, NoChromium, PageFailed: there is nothing to draw with.
    """
    if path.exists() and not force:
        raise OutputExists(path)
    require_within(timelines, from_s, option="--at")
    if until_s is not None:
        require_within(timelines, until_s, option="--until")
    end_s = max(t.duration_s for t in same_house(timelines)) if until_s is None else until_s
    if not 0 <= from_s < end_s:
        raise BadValue("part of the run", f"{from_s:g} to {end_s:g} s", "from a moment to a later one")
    if not 0.01 <= speed <= 10_000:
        raise BadValue("--speed", speed, "from 0.01 to 10000")
    if not 1 <= frames_a_second <= 60:
        raise BadValue("--fps", frames_a_second, "from 1 to 60")
    width, height = framing.width // 2 * 2, framing.height // 2 * 2
    count = max(2, round((end_s - from_s) / speed * frames_a_second) + 1)
    moments = [from_s + (end_s - from_s) * i / (count - 1) for i in range(count)]
    with page_of(timelines, width=width, height=height) as page:
        covered = CAPTION_LINE_PX * (2 + len(same_house(timelines))) + 8 if framing.caption else 0
        page.evaluate("(o) => window.lios.bare(o)", framing.options | {"caption": False, "coveredPx": covered})
        page.evaluate("([w, f]) => { window.lios.walls(w); window.lios.follow(f); }", [framing.walls, framing.follow])
        page.evaluate("(o) => window.liosFilm.begin(o)", _film(width, height, frames_a_second, framing))
        samples: list[Sample] = []
        blocks = [moments[i : i + FRAMES_PER_CALL] for i in range(0, count, FRAMES_PER_CALL)]
        for block in progress(blocks, title="drawing", total=len(blocks)):
            samples += _samples(page.evaluate("(m) => window.liosFilm.draw(m)", block))
        last = page.evaluate("() => window.liosFilm.end()")
        samples += _samples(last["chunks"])
        description = base64.b64decode(last["description"])
    if len(samples) != count or not description:
        raise PageFailed(f"{len(samples)} of {count} frames were encoded")
    make_folder(path.parent)
    write_atomically(path, mp4(samples, description, width=width, height=height, frames_a_second=frames_a_second))
    return count


def _film(width: int, height: int, frames_a_second: int, framing: Framing) -> dict[str, Any]:
    return {"width": width, "height": height, "fps": frames_a_second, "caption": framing.caption}


def _samples(chunks: list[dict[str, Any]]) -> list[Sample]:
    return [Sample(base64.b64decode(chunk["data"]), chunk["key"]) for chunk in chunks]
