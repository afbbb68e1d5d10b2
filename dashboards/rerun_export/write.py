"""Writes a run as a Rerun recording (.rrd) with the blueprint by which its viewer opens it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from dashboards.model.belief_series import belief_series
from dashboards.model.scene import scene_at
from dashboards.model.timeline import Timeline
from dashboards.rerun_export.containers import log_containers
from dashboards.rerun_export.house import log_house
from dashboards.rerun_export.robot import log_robot
from dashboards.rerun_export.series import log_series
from dashboards.rerun_export.text_log import log_words
from dashboards.rerun_export.times import SINCE_START
from replayers.log_tools.notes import RunNote
from workbench.errors import OutputExists
from workbench.files import atomic
from workbench.worlds.names import readable_name

APPLICATION = "lios"
"""Recordings of one application share a blueprint in Rerun's viewer."""


def write_rrd(timeline: Timeline, notes: Sequence[RunNote], output: Path, *, force: bool = False) -> int:
    """Write a run as a recording whose id is the run's; returns the size of the file in bytes.

    Rerun gives each row its own id, so that two exports of one run differ in bytes, not in what they hold.

    Args:
        notes: people's notes on the run.

    Raises:
        OutputExists: the file is there and force is not given.
    """
    if output.exists() and not force:
        raise OutputExists(output)
    output.parent.mkdir(parents=True, exist_ok=True)
    with atomic(output) as draft:
        draft.touch()  # a folder without write permission raises OSError here, instead of one of Rerun's errors
        recording = rr.RecordingStream(APPLICATION, recording_id=timeline.run.info.run_id)
        recording.save(draft, default_blueprint=_blueprint(timeline))
        recording.send_recording_name(f"{timeline.run.path.stem}: {timeline.task_words}")
        log_house(recording, timeline.plan)
        log_containers(recording, timeline)
        log_robot(recording, timeline)
        log_series(recording, timeline)
        log_words(recording, timeline, notes)
        recording.flush()
        recording.disconnect()
    return output.stat().st_size


def _blueprint(timeline: Timeline) -> rrb.Blueprint:
    """The house on the left; costs, beliefs and lines of text on the right.

    Of the beliefs it shows those in the item first sought, for the containers that were ever most believed.
    """
    first_ns = timeline.decision_ns[0] if timeline.decision_ns else timeline.start_ns
    focus = scene_at(timeline, first_ns).focus
    likeliest = [rr.new_entity_path(["belief", focus, container]) for container in belief_series(timeline, focus)]
    house = rrb.Spatial3DView(
        origin="/",
        contents=["/house/**", "/containers/**", "/items/**", "/robot/**", "/way/**"],
        name="House",
        background=(246, 246, 244),
        line_grid=False,
    )
    beside = rrb.Vertical(
        rrb.TimeSeriesView(origin="/cost", name="Cost"),
        rrb.TimeSeriesView(origin="/find_costs", name="Find costs"),
        rrb.TimeSeriesView(origin="/belief", contents=likeliest, name=f"Belief: {readable_name(focus)}"),
        rrb.TextLogView(origin="/log", name="What happened"),
    )
    return rrb.Blueprint(
        rrb.Horizontal(house, beside, column_shares=[3, 2]),
        rrb.TimePanel(timeline=SINCE_START, state="collapsed"),
        collapse_panels=True,
    )
