"""`lios render`: a picture or a video of runs, without a browser window."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from workbench.options import Force, Json
from workbench.parameters import Argument, Option


def render(
    logs: Annotated[list[Path], Argument(help="Logs of one task, or a folder of them; the first is in focus.")],
    output: Annotated[Path, Option("-o", "--output", help="The .png or .mp4 to write.")] = Path("frame.png"),
    at: Annotated[float, Option(help="Seconds after the start; for a video, where it begins.")] = 0.0,
    video: Annotated[bool, Option("--video", help="A video (MP4) instead of a picture.")] = False,
    until: Annotated[float | None, Option(help="Where a video ends, in seconds after the start.")] = None,
    speed: Annotated[float, Option(help="Seconds of the run in one second of the video.")] = 4.0,
    fps: Annotated[int, Option(help="Frames per second of a video.")] = 24,
    width: Annotated[int, Option(help="Width in pixels.")] = 1280,
    height: Annotated[int, Option(help="Height in pixels.")] = 720,
    from_above: Annotated[bool, Option("--from-above", help="Look straight down.")] = False,
    follow_robot: Annotated[bool, Option("--follow-robot", help="Look from behind the robot.")] = False,
    walls: Annotated[str, Option(help="cut, whole or none.")] = "cut",
    caption: Annotated[bool, Option("--caption/--no-caption", help="Say what is shown.")] = True,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Draw a moment of runs as PNG, or the runs as MP4.

    Examples:

        lios render run.mcap --at 12.5 -o frame.png

        lios render run.mcap greedy.mcap --video --speed 8 -o both.mp4
    """
    given = dict(locals())
    from dashboards.library.same_place import read_together, same_house
    from dashboards.rendering.picture import Framing, draw_picture
    from dashboards.rendering.video import draw_video
    from replayers.commands.losses import end_with_losses
    from replayers.runs.gaps import losses
    from workbench.errors import BadValue
    from workbench.parameters import require_left_out
    from workbench.terminal import emit_json, say

    film = video or output.suffix.lower() == ".mp4"
    ending = ".mp4" if film else ".png"
    if output.suffix.lower() != ending:
        raise BadValue("-o/--output", str(output), f"a name that ends in {ending}")
    if not film:
        of_films = ("until", "speed", "fps")
        require_left_out(render, given, but=[name for name in given if name not in of_films], where="without --video")
    framing = Framing(
        width=width, height=height, from_above=from_above, follow=follow_robot, walls=walls, caption=caption
    )
    together, frames = read_together(logs), 1
    timelines = together.timelines
    if film:
        frames = draw_video(
            timelines,
            output,
            framing=framing,
            from_s=at,
            until_s=until,
            speed=speed,
            frames_a_second=fps,
            force=force,
        )
    else:
        draw_picture(timelines, output, at_s=at, framing=framing, force=force)
    found = losses(timeline.run for timeline in same_house(timelines))
    if as_json:
        emit_json(
            {
                "output": str(output),
                "frames": frames,
                "width": width,
                "height": height,
                "left_out": together.left_out,
                "lost": found.lost,
                "cut_off": found.cut_off,
            }
        )
    else:
        say(f"Wrote {output}" + (f" ({frames} frames)." if frames > 1 else "."))
    end_with_losses(found, unreadable=len(together.unreadable))
