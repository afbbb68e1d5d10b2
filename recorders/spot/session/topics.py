"""The topics of a robot session: our own JSON messages, beside Foxglove's and bosdyn's.

/robot/status       battery, motors, emergency stop, faults, lease owner            json  lios.spot.RobotStatus
/robot/clock        by how much the robot's clock is ahead of ours                  json  lios.spot.ClockSkew
/robot/detections   every detection of a tag: pose, range, place                    json  lios.spot.TagDetected
/robot/tag_polls    every answer to which tags are seen, also where none is     json  lios.spot.TagPoll
/session/gap        from when to when the robot was away                            json  lios.spot.Gap
/session/status     link, tags seen now, messages dropped, room on the disk, next   json  lios.spot.SessionStatus
/session/note       what the operator noted                                         json  lios.spot.Note
/notes              the same, as lios log note and Foxglove have it                 protobuf, foxglove.Event
/spot/...           bosdyn's messages as they came                                  protobuf, bosdyn.api.*
/tf /robot/pose /robot/odometry /robot/fiducials /robot/local_grid /camera/...      protobuf, foxglove.*

A protobuf message that came while the time sync was away is in a second channel of its topic, whose metadata has
"lios.stamps": "uncertain": its publish_time is by an old skew.

Class docstrings are part of the JSON Schemas in logs (as descriptions): changing one changes the bytes of logs.
"""

from __future__ import annotations

from functools import lru_cache

import msgspec

from recorders.mcap_io.channels import ChannelSpec, json_schema
from recorders.mcap_io.viewer_schema import viewer_schema
from workbench.log_schema.events import Stamp

STATUS, CLOCK, GAP, NOTE = "/robot/status", "/robot/clock", "/session/gap", "/session/note"
NOTE_EVENTS, SESSION_STATUS, DETECTIONS = "/notes", "/session/status", "/robot/detections"
TAG_POLLS = "/robot/tag_polls"
ROBOT_STATE, LOCALIZATION, WORLD_OBJECTS = "/spot/robot_state", "/spot/localization", "/spot/world_objects"
ODOMETRY, FIDUCIALS, LOCAL_GRID, CAMERA = "/robot/odometry", "/robot/fiducials", "/robot/local_grid", "/camera"


class RobotStatus(msgspec.Struct, frozen=True, kw_only=True):
    """battery_percent is 0 to 100; faults are the robot's own words."""

    stamp: Stamp
    battery_percent: float
    battery_left_s: float
    motors: str
    estopped: bool
    localized: bool
    holding: bool
    faults: tuple[str, ...] = ()


class ClockSkew(msgspec.Struct, frozen=True, kw_only=True):
    """robot time = our time + skew_ns; round_trip_ns is of the exchange that it was measured with.

    While uncertain, the skew could not be measured: robot stamps since the last certain message are by an old one.
    """

    stamp: Stamp
    skew_ns: int
    round_trip_ns: int = 0
    uncertain: bool = False


class Gap(msgspec.Struct, frozen=True, kw_only=True):
    """The robot did not answer between start and end; reason is the first error, in a few words."""

    stamp: Stamp
    start: Stamp
    end: Stamp
    seconds: float
    reason: str


class Note(msgspec.Struct, frozen=True, kw_only=True):
    """What an operator noted."""

    stamp: Stamp
    text: str


class SessionStatus(msgspec.Struct, frozen=True, kw_only=True):
    """The session once a second. silent_s: since the robot's last answer; tags: items whose tags are seen now, or
    tag numbers; dropped: messages so far; doing: what the robot is about to do.

    battery_percent is 0 to 100, negative where the robot has not told it.
    """

    stamp: Stamp
    battery_percent: float
    localized: bool
    silent_s: float
    tags: tuple[str, ...]
    dropped: int
    disk_free_mb: int
    doing: str = ""


class TagPose(msgspec.Struct, frozen=True, kw_only=True):
    """frame_tform_tag, metres and a unit quaternion; x to the right and y up along the tag, z out of the page."""

    frame: str
    x: float
    y: float
    z: float
    qx: float
    qy: float
    qz: float
    qw: float


class TagDetected(msgspec.Struct, frozen=True, kw_only=True):
    """One detection of a tag; stamp is the time of acquisition.

    raw is what the detector reported, of a tag of the size that it expects; x_m, y_m, z_m is the tag on the map, of
    size_m, where the body was then (left out if the robot was not localised). container is where that is, "" if at
    none. age_s is from acquisition to receipt; range_m and incidence_deg are from the camera that saw it (left out if
    it is unknown). detector: robot or opencv; counts: whether looks go by it.
    """

    stamp: Stamp
    tag: int
    item: str = ""
    detector: str = "robot"
    camera: str = ""
    status: str = "unknown"
    raw: TagPose
    size_m: float
    age_s: float
    range_m: float | None = None
    incidence_deg: float | None = None
    error_px: float | None = None
    x_m: float | None = None
    y_m: float | None = None
    z_m: float | None = None
    container: str = ""
    counts: bool = True


class TagPoll(msgspec.Struct, frozen=True, kw_only=True):
    """A detector was asked which tags it sees, at stamp; tags are those of the last two seconds, [] if it saw none.

    detector: robot or opencv; counts: whether looks go by it; localized: whether the robot knew its pose on the map.
    """

    stamp: Stamp
    detector: str = "robot"
    counts: bool = True
    localized: bool
    tags: tuple[int, ...]


SessionFact = SessionStatus | RobotStatus | ClockSkew | Gap | Note | TagDetected | TagPoll
TOPIC_OF_FACT: dict[type[msgspec.Struct], str] = {
    SessionStatus: SESSION_STATUS,
    RobotStatus: STATUS,
    ClockSkew: CLOCK,
    Gap: GAP,
    Note: NOTE,
    TagDetected: DETECTIONS,
    TagPoll: TAG_POLLS,
}


@lru_cache(maxsize=64)
def fact_channel(fact_class: type[msgspec.Struct]) -> ChannelSpec:
    """The channel of a message class; gaps and notes are marked important."""
    return ChannelSpec(
        topic=TOPIC_OF_FACT[fact_class],
        message_encoding="json",
        schema_name=f"lios.spot.{fact_class.__name__}",
        schema_encoding="jsonschema",
        schema_data=msgspec.json.encode(viewer_schema(json_schema(fact_class))),
        important=fact_class in (Gap, Note),
    )
