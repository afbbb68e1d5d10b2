"""Channel descriptions (topic, encoding and schema), independent of any file."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import msgspec

from recorders.mcap_io.viewer_schema import viewer_schema
from workbench.log_schema.events import TOPIC_OF, schema_name

if TYPE_CHECKING:
    from google.protobuf.message import Message

STAMPS, UNCERTAIN = "lios.stamps", "uncertain"
"""Metadata of a channel whose messages came while the clock of their source was not compared with ours."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelSpec:
    """A channel.

    Attributes:
        message_encoding: "json", "protobuf", "cdr", "ros1", ..., as in the MCAP registry.
        schema_name, schema_encoding, schema_data: as in MCAP; an empty schema_name means no schema.
        metadata: sorted key-value pairs.
        latched: the last message is repeated at the start of every part of a split log.
        important: dropped last if writing cannot keep up.
    """

    topic: str
    message_encoding: str
    schema_name: str = ""
    schema_encoding: str = ""
    schema_data: bytes = b""
    metadata: tuple[tuple[str, str], ...] = ()
    latched: bool = False
    important: bool = False


@lru_cache(maxsize=64)
def json_channel(event_class: type[msgspec.Struct], *, latched: bool = False) -> ChannelSpec:
    """The channel of an event class of the log schema: JSON, a JSON Schema that viewers read; important."""
    return ChannelSpec(
        topic=TOPIC_OF[event_class],
        message_encoding="json",
        schema_name=schema_name(event_class),
        schema_encoding="jsonschema",
        schema_data=msgspec.json.encode(viewer_schema(json_schema(event_class))),
        latched=latched,
        important=True,
    )


@lru_cache(maxsize=256)
def protobuf_channel(
    topic: str, message_class: type[Message], *, latched: bool = False, uncertain: bool = False
) -> ChannelSpec:
    """A channel of a protobuf class, such as Foxglove's, with its descriptors.

    Args:
        uncertain: the stamps of its messages are by an old skew; a second channel beside the topic's other one.
    """
    from mcap_protobuf.schema import build_file_descriptor_set  # loads protobuf: a tenth of a command's start

    return ChannelSpec(
        topic=topic,
        message_encoding="protobuf",
        schema_name=message_class.DESCRIPTOR.full_name,
        schema_encoding="protobuf",
        schema_data=build_file_descriptor_set(message_class).SerializeToString(deterministic=True),
        metadata=((STAMPS, UNCERTAIN),) if uncertain else (),
        latched=latched,
    )


def json_schema(event_class: type[msgspec.Struct]) -> dict[str, Any]:
    """The JSON Schema of a wire class, exact and self-contained, with an object at its root."""
    schema = msgspec.json.schema(event_class)
    definitions = schema["$defs"]
    root = definitions.pop(event_class.__name__)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **root, "$defs": definitions}
