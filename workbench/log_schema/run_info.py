"""The identity and outcome of a run as MCAP metadata records, with all values as text and with checksums."""

from __future__ import annotations

import zlib
from collections.abc import Mapping

import msgspec

from workbench.errors import Malformed
from workbench.log_schema.events import SCHEMA_VERSION, Outcome, RunInfo, Stamp

INFO_METADATA = "lios.run"
OUTCOME_METADATA = "lios.outcome"
"""Status and costs, written again at the end, so that logs can be listed without reading messages."""
ROBOT_METADATA = "lios.robot"
"""Which robot a log is of, as that robot says."""
PART_METADATA = "lios.part"
"""Which part of a split log it is: part (from 0), before (the previous file)."""
CHECKSUM = "crc32"
"""Key of the checksum over the other pairs, since MCAP has none on metadata records."""


class MalformedInfo(Malformed):
    """The metadata record lios.run is invalid."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"metadata {INFO_METADATA} identifies no run: {reason}. Run lios doctor on the log.")


class NewerSchema(Malformed):
    """The log has a newer schema version."""

    def __init__(self, version: int) -> None:
        super().__init__(
            f"the log has schema version {version}, and this release reads up to {SCHEMA_VERSION}. "
            "Update lios-workbench."
        )


def info_to_metadata(info: RunInfo) -> dict[str, str]:
    """The key-value pairs of a run's identity, deterministic; `started` in nanoseconds since the Unix epoch."""
    pairs = {name: _text(getattr(info, name)) for name in info.__struct_fields__}
    return {**pairs, CHECKSUM: checksum(INFO_METADATA, pairs)}


def info_from_metadata(pairs: Mapping[str, str]) -> RunInfo:
    """Decode the identity; unknown keys are ignored for forward compatibility.

    Raises:
        MalformedInfo: a key is missing or its value is invalid.
        NewerSchema: the schema version is newer than this release supports.
    """
    values: dict[str, object] = {name: pairs[name] for name in RunInfo.__struct_fields__ if name in pairs}
    try:
        version = int(pairs.get("schema_version", ""))
        started_ns = int(pairs.get("started", ""))
    except ValueError:
        raise MalformedInfo("schema_version and started must be whole numbers") from None
    if version > SCHEMA_VERSION:
        raise NewerSchema(version)
    values["started"] = Stamp.of(started_ns)
    try:
        return msgspec.convert(values, RunInfo, strict=False)
    except msgspec.ValidationError as error:
        raise MalformedInfo(str(error)) from error


def is_simulated(robot: Mapping[str, str]) -> bool:
    """Whether a log is of a simulated robot, by what that says of itself; early logs have its serial number alone."""
    return robot.get("simulated") == "true" or robot.get("serial") == "simulated-spot"


def outcome_to_metadata(outcome: Outcome, decisions: int) -> dict[str, str]:
    """The key-value pairs of a run's outcome; costs keep every digit."""
    names = ("status", "cost", "own_cost", "searches", "travel_m", "reason")
    pairs = {name: str(getattr(outcome, name)) for name in names}
    pairs |= {"ended": str(outcome.stamp.ns), "decisions": str(decisions)}
    return {**pairs, CHECKSUM: checksum(OUTCOME_METADATA, pairs)}


def checksum(name: str, pairs: Mapping[str, str]) -> str:
    """Checksum (eight hexadecimal digits) of a record's name and of all pairs but the checksum, sorted."""
    text = f"{name}\n" + "".join(f"{key}={pairs[key]}\n" for key in sorted(pairs) if key != CHECKSUM)
    return f"{zlib.crc32(text.encode()):08x}"


def is_intact(name: str, pairs: Mapping[str, str]) -> bool:
    """Whether a record matches its checksum; True for records without one."""
    return CHECKSUM not in pairs or pairs[CHECKSUM] == checksum(name, pairs)


def _text(value: object) -> str:
    if isinstance(value, Stamp):
        return str(value.ns)
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value)
