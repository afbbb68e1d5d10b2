"""Which run is this? Its identity as the metadata record `lios.run`: every value as text, with a checksum."""

from __future__ import annotations

import zlib
from collections.abc import Mapping

import msgspec

from workbench.errors import Malformed
from workbench.runs.vocabulary import SCHEMA_VERSION, Outcome, RunInfo, Stamp

INFO_METADATA = "lios.run"
OUTCOME_METADATA = "lios.outcome"
"""Status and costs once more, written at the end, so that a folder of logs is listed without reading messages."""
CHECKSUM = "crc32"
"""MCAP has no checksum on metadata records; this key holds one over the other pairs."""


class MalformedInfo(Malformed):
    """A metadata record lios.run that identifies no run."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"metadata {INFO_METADATA} identifies no run: {reason}. Run lios doctor on the log.")


class NewerSchema(Malformed):
    """A log of a later release."""

    def __init__(self, version: int) -> None:
        super().__init__(
            f"the log has schema version {version}, and this release reads up to {SCHEMA_VERSION}. "
            "Update lios-workbench."
        )


def info_to_metadata(info: RunInfo) -> dict[str, str]:
    """The record's pairs, the same for the same run; `started` in nanoseconds since the Unix epoch."""
    pairs = {name: _text(getattr(info, name)) for name in info.__struct_fields__}
    return {**pairs, CHECKSUM: checksum(INFO_METADATA, pairs)}


def info_from_metadata(pairs: Mapping[str, str]) -> RunInfo:
    """The identity again; unknown keys are ignored, so that later fields do no harm.

    Raises:
        MalformedInfo: a key is missing or of the wrong kind.
        NewerSchema: a schema version beyond this release's.
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


def outcome_to_metadata(outcome: Outcome, decisions: int) -> dict[str, str]:
    """The record's pairs; costs with every digit."""
    names = ("status", "cost", "own_cost", "searches", "travel_m", "reason")
    pairs = {name: str(getattr(outcome, name)) for name in names}
    pairs |= {"ended": str(outcome.stamp.ns), "decisions": str(decisions)}
    return {**pairs, CHECKSUM: checksum(OUTCOME_METADATA, pairs)}


def checksum(name: str, pairs: Mapping[str, str]) -> str:
    """Of a record's name and all pairs but the checksum's own, in sorted order, as eight hexadecimal digits."""
    text = f"{name}\n" + "".join(f"{key}={pairs[key]}\n" for key in sorted(pairs) if key != CHECKSUM)
    return f"{zlib.crc32(text.encode()):08x}"


def is_intact(name: str, pairs: Mapping[str, str]) -> bool:
    """Whether a record is what was written; one without a checksum is believed."""
    return CHECKSUM not in pairs or pairs[CHECKSUM] == checksum(name, pairs)


def _text(value: object) -> str:
    if isinstance(value, Stamp):
        return str(value.ns)
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value)
