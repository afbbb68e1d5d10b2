"""Messages with pictures, their faces or text blurred; what holds pictures of another kind is left out."""

from __future__ import annotations

import base64
import binascii
import io
import re
from collections import Counter
from dataclasses import dataclass, field
from typing import Any, final

import msgspec
import numpy as np
from mcap.records import Attachment, Channel, Schema
from mcap_protobuf.decoder import DecoderFactory
from PIL import Image

from replayers.log_tools.faces.face_finder import Box, FaceFinder
from replayers.log_tools.faces.text_finder import TextFinder
from replayers.mcap_io.messages import Message
from workbench.arrays import Uints8
from workbench.caches import Cache
from workbench.log_schema.events import NANO

HOLD_S = 1.0
"""Where a face was found, pictures stay blurred for so long: detection flickers."""
MAX_PIXELS = 100_000_000
QUALITY = 90
MAX_CACHED_DECODERS = 100
_PICTURES = re.compile(r"image|video|picture|photo|ffmpeg|theora", re.IGNORECASE)
_NO_PICTURES = re.compile(r"annotation|marker|calibration", re.IGNORECASE)
COMPRESSED, SPOT_IMAGE = "foxglove.CompressedImage", "bosdyn.api.ImageResponse"
DEPTH_U16 = 5
"""bosdyn.api.Image.PIXEL_FORMAT_DEPTH_U16."""


class Unreadable(ValueError):
    """A picture that cannot be decoded, or is too large."""


@final
@dataclass(slots=True)
class FaceBlur:
    """Blurs faces, text or both in the pictures of messages, one log at a time, in its order.

    Pictures without any pass byte for byte. What the finders do not see stays visible.

    Attributes:
        finder: of faces; None leaves them. text: of text; None leaves it.
        pictures, faces, texts: how many pictures were searched, and how many faces and pieces of text were blurred in
            them, by topic.
        left_out: messages whose pictures cannot be searched, and attachments, by topic or name.
    """

    finder: FaceFinder | None = field(default_factory=FaceFinder)
    text: TextFinder | None = None
    pictures: Counter[str] = field(default_factory=Counter[str])
    faces: Counter[str] = field(default_factory=Counter[str])
    texts: Counter[str] = field(default_factory=Counter[str])
    left_out: Counter[str] = field(default_factory=Counter[str])
    _held: dict[str, list[tuple[int, Box]]] = field(default_factory=dict)
    _decoders: Cache[tuple[str, int, int], Any] = field(default_factory=lambda: Cache(MAX_CACHED_DECODERS))

    def concerns(self, channel: Channel, schema: Schema | None) -> bool:
        """Whether messages of a channel may hold pictures, by the name of their schema."""
        name = channel.topic if schema is None or not schema.name else schema.name
        return _PICTURES.search(name) is not None and _NO_PICTURES.search(name) is None

    def changed(self, message: Message) -> Message | None:
        """The message with its faces blurred; None if it holds a picture that cannot be searched."""
        kind = "" if message.schema is None else message.schema.name
        encoding = message.channel.message_encoding
        try:
            if encoding == "protobuf" and kind == COMPRESSED:
                data = self._protobuf(message)
            elif encoding == "protobuf" and kind == SPOT_IMAGE:
                data = self._spot(message)
            elif encoding == "json" and kind == COMPRESSED:
                data = self._json(message)
            else:
                raise Unreadable
        except Unreadable:
            self.left_out[message.topic] += 1
            return None
        return message if data is None else message._replace(data=data)

    def keeps(self, attachment: Attachment) -> bool:
        """Whether an attachment stays: pictures and videos are left out."""
        if attachment.media_type.startswith(("image/", "video/")):
            self.left_out[attachment.name] += 1
            return False
        return True

    def _protobuf(self, message: Message) -> bytes | None:
        decoded = self._decoded(message)
        changed = self._blurred(bytes(decoded.data), message)
        if changed is None:
            return None
        decoded.data = changed
        return bytes(decoded.SerializeToString(deterministic=True))

    def _spot(self, message: Message) -> bytes | None:
        """An image response of Spot: most are stored without their pixels, and depth shows no face."""
        decoded = self._decoded(message)
        image = decoded.shot.image
        if not image.data or image.pixel_format == DEPTH_U16:
            return None
        changed = self._blurred(bytes(image.data), message)
        if changed is None:
            return None
        image.data = changed
        return bytes(decoded.SerializeToString(deterministic=True))

    def _json(self, message: Message) -> bytes | None:
        try:
            decoded = msgspec.json.decode(message.data, type=dict[str, Any])
            data = base64.b64decode(decoded["data"], validate=True)
        except (msgspec.DecodeError, KeyError, TypeError, binascii.Error) as error:
            raise Unreadable from error
        changed = self._blurred(data, message)
        if changed is None:
            return None
        return msgspec.json.encode({**decoded, "data": base64.b64encode(changed).decode()})

    def _decoded(self, message: Message) -> Any:
        schema = message.schema
        if schema is None:
            raise Unreadable
        key = (schema.name, schema.id, hash(schema.data))
        try:
            decode = self._decoders.get(key, lambda: DecoderFactory().decoder_for("protobuf", schema))
            if decode is None:
                raise Unreadable
            return decode(message.data)
        except Exception as error:  # a schema from elsewhere can break its parser in any way
            raise Unreadable from error

    def _blurred(self, data: bytes, message: Message) -> bytes | None:
        """An encoded picture with its faces blurred; None if it has none."""
        picture, kind = _opened(data)
        faces = () if self.finder is None else self.finder.boxes(picture)
        texts = () if self.text is None else self.text.boxes(picture)
        found, now_ns = (*faces, *texts), message.log_time
        held = [(ns, box) for ns, box in self._held.get(message.topic, ()) if 0 <= now_ns - ns <= HOLD_S * NANO]
        self._held[message.topic] = [*held, *((now_ns, box) for box in found)]
        boxes = tuple(dict.fromkeys((*found, *(box for _, box in held))))
        self.pictures[message.topic] += 1
        self.faces[message.topic] += len(faces)
        self.texts[message.topic] += len(texts)
        finder = self.finder or self.text
        return _encoded(finder.blurred(picture, boxes), kind) if boxes and finder is not None else None


def _opened(data: bytes) -> tuple[Uints8, str]:
    """A picture as grey values or colours, and its format."""
    try:
        with Image.open(io.BytesIO(data), formats=("JPEG", "PNG", "WEBP")) as image:
            if image.width * image.height > MAX_PIXELS or getattr(image, "n_frames", 1) != 1:
                raise Unreadable
            kind = image.format or ""
            return np.asarray(image.convert("L" if image.mode == "L" else "RGB")), kind
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise Unreadable from error


def _encoded(picture: Uints8, kind: str) -> bytes:
    stream = io.BytesIO()
    options = {} if kind == "PNG" else {"quality": QUALITY}
    Image.fromarray(picture).save(stream, kind, **options)
    return stream.getvalue()
