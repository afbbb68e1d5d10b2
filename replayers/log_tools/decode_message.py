"""Messages as JSON values, whatever their encoding, as far as the log describes it."""

from __future__ import annotations

import base64
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, final

import msgspec
from google.protobuf.json_format import MessageToDict
from mcap.records import Schema

from replayers.mcap_io.cdr import require_plain_cdr
from replayers.mcap_io.messages import Message
from workbench.caches import Cache

SHORT_BYTES = 120
MAX_CACHED_DECODERS = 1000
"""Longer byte fields are shown as their length, unless all bytes are requested."""


@final
@dataclass(slots=True)
class MessageDecoder:
    """Turns messages into values that JSON can hold; decoders are created once for each schema.

    Attributes:
        whole: show all bytes, in base64.
    """

    whole: bool = False
    _decoders: Cache[tuple[str, int, int], Callable[[bytes], Any] | None] = field(
        default_factory=lambda: Cache(MAX_CACHED_DECODERS)
    )

    def value(self, message: Message) -> Any:
        """The decoded message; its bytes, in base64 or counted, where it cannot be decoded."""
        try:
            if message.channel.message_encoding == "json":
                return msgspec.json.decode(message.data)
            decoder = self._decoder(message)
            if decoder is not None:
                return self._plain(decoder(message.data))
        except Exception as error:  # noqa: BLE001  a schema from elsewhere can break its parser in any way
            return {"undecodable": f"{type(error).__name__}: {error}"[:200], **self._bytes(message.data)}
        return self._bytes(message.data)

    def line(self, message: Message) -> dict[str, Any]:
        """A message with its topic and times."""
        return {
            "topic": message.topic,
            "sequence": message.sequence,
            "log_time": message.log_time,
            "publish_time": message.publish_time,
            "data": self.value(message),
        }

    def _decoder(self, message: Message) -> Callable[[bytes], Any] | None:
        schema = message.schema
        if schema is None:
            return None
        key = (message.channel.message_encoding, schema.id, hash(schema.data))
        return self._decoders.get(key, lambda: _decoder_or_reason(message.channel.message_encoding, schema))

    def _plain(self, value: Any) -> Any:
        if isinstance(value, dict):
            return {key: self._plain(part) for key, part in value.items()}
        if isinstance(value, list | tuple):
            return [self._plain(part) for part in value]
        if isinstance(value, bytes | bytearray):
            return self._bytes(bytes(value))
        if isinstance(value, str) and not self.whole and len(value) > 10 * SHORT_BYTES:
            return f"{value[:SHORT_BYTES]}... ({len(value)} characters)"
        return value

    def _bytes(self, data: bytes) -> dict[str, Any]:
        if self.whole or len(data) <= SHORT_BYTES:
            return {"base64": base64.b64encode(data).decode("ascii")}
        return {"bytes": len(data)}


def _broken_schema(error: Exception) -> Callable[[bytes], Any]:
    """A decoder that gives the reason why there is none; the schema is parsed once, not for every message."""
    why = f"its schema cannot be used ({type(error).__name__}: {error})"

    def refuse(data: bytes) -> Any:
        raise ValueError(why)

    return refuse


def _decoder_or_reason(encoding: str, schema: Schema) -> Callable[[bytes], Any] | None:
    try:
        return _decoder_for(encoding, schema)
    except Exception as error:  # noqa: BLE001  a schema from elsewhere can fail in any way
        return _broken_schema(error)


def _decoder_for(encoding: str, schema: Schema) -> Callable[[bytes], Any] | None:
    if encoding == "protobuf" and schema.encoding == "protobuf":
        from mcap_protobuf.decoder import DecoderFactory

        decode = DecoderFactory().decoder_for(encoding, schema)
        if decode is None:
            return None
        return lambda data: MessageToDict(
            decode(data), preserving_proto_field_name=True, always_print_fields_with_no_presence=True
        )
    if encoding == "cdr":
        try:
            from mcap_ros2.decoder import DecoderFactory as RosDecoders
        except ImportError:
            return None
        decode = RosDecoders().decoder_for(encoding, schema)
        return None if decode is None else lambda data: _ros(decode(_plain_cdr(data)))
    return None


def _plain_cdr(data: bytes) -> bytes:
    require_plain_cdr(data)
    return data


def _ros(value: Any) -> Any:
    """A ROS message as plain values; one without fields is an empty object."""
    if value is None or isinstance(value, bool | int | float | str | bytes | bytearray):
        return value
    if isinstance(value, list | tuple):
        return [_ros(part) for part in value]
    if isinstance(value, dict):
        return {name: _ros(part) for name, part in value.items()}
    names = getattr(type(value), "__slots__", None) or getattr(value, "__dict__", ())
    return {name: _ros(getattr(value, name)) for name in names}
