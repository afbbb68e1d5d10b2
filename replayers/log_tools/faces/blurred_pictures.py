"""Messages with pictures, their faces, text or screens blurred; what holds pictures of another kind is left out."""

from __future__ import annotations

import base64
import binascii
import io
import re
from bisect import bisect_left, bisect_right, insort
from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, final

import msgspec
import numpy as np
from mcap.records import Attachment, Channel, Schema
from mcap_protobuf.decoder import DecoderFactory
from PIL import Image

from replayers.log_tools.faces.face_finder import Box, FaceFinder
from replayers.log_tools.faces.screens.screen_finder import ScreenFinder
from replayers.log_tools.faces.text_finder import TextFinder
from replayers.mcap_io.messages import Message
from workbench.arrays import Uints8
from workbench.caches import Cache
from workbench.log_schema.events import NANO

HOLD_S = 1.0
"""Where something was found, pictures are blurred for so long before and after: detection flickers."""
MAX_PIXELS = 100_000_000
QUALITY = 90
MAX_CACHED_DECODERS = 100
_PICTURES = re.compile(r"image|video|picture|photo|ffmpeg|theora", re.IGNORECASE)
_NO_PICTURES = re.compile(r"annotation|marker|calibration", re.IGNORECASE)
COMPRESSED, SPOT_IMAGE = "foxglove.CompressedImage", "bosdyn.api.ImageResponse"
DEPTH_U16 = 5
"""bosdyn.api.Image.PIXEL_FORMAT_DEPTH_U16."""


PictureChange = Callable[[bytes, Message], bytes | None]
"""What is done to the encoded picture of a message; None to leave it as it is."""


class Unreadable(ValueError):
    """A picture that cannot be decoded, or is too large."""


@final
@dataclass(slots=True)
class FaceBlur:
    """Blurs faces, text and screens in the pictures of messages, one log at a time, in its order.

    Pictures without any pass byte for byte. What the finders do not see stays visible. A log that is looked through
    before it is changed (`look`) is also blurred for HOLD_S before something is found.

    Attributes:
        finder: of faces; None leaves them. text: of text. screen: of screens.
        pictures, faces, texts, screens: how many pictures were searched, and how many faces, pieces of text and
            screens were found in them, by topic.
        left_out: messages whose pictures cannot be searched, and attachments, by topic or name.
    """

    finder: FaceFinder | None = field(default_factory=FaceFinder)
    text: TextFinder | None = None
    screen: ScreenFinder | None = None
    pictures: Counter[str] = field(default_factory=Counter[str])
    faces: Counter[str] = field(default_factory=Counter[str])
    texts: Counter[str] = field(default_factory=Counter[str])
    screens: Counter[str] = field(default_factory=Counter[str])
    left_out: Counter[str] = field(default_factory=Counter[str])
    _found: dict[str, list[tuple[int, Box]]] = field(default_factory=lambda: defaultdict(list))
    """What was found in pictures of a topic, by time."""
    _searched: set[tuple[str, int, int]] = field(default_factory=set[tuple[str, int, int]])
    """Topic, time and hash of the pictures that were searched."""
    _decoders: Cache[tuple[str, int, int], Any] = field(default_factory=lambda: Cache(MAX_CACHED_DECODERS))

    def concerns(self, channel: Channel, schema: Schema | None) -> bool:
        """Whether messages of a channel may hold pictures, by the name of their schema."""
        name = channel.topic if schema is None or not schema.name else schema.name
        return _PICTURES.search(name) is not None and _NO_PICTURES.search(name) is None

    def look(self, message: Message) -> None:
        """Searches the picture of a message: those before it are blurred where something is in this one."""
        try:
            self._rewritten(message, self._search)
        except Unreadable:
            return  # left out and counted when it is to be changed

    def changed(self, message: Message) -> Message | None:
        """The message with what was found blurred; None if it holds a picture that cannot be searched."""
        try:
            data = self._rewritten(message, self._blurred)
        except Unreadable:
            self.left_out[message.topic] += 1
            return None
        return message if data is None else message._replace(data=data)

    def _rewritten(self, message: Message, change: PictureChange) -> bytes | None:
        """The data of a message with its encoded picture changed; None if the change answers so, or it has none."""
        kind = "" if message.schema is None else message.schema.name
        encoding = message.channel.message_encoding
        if encoding == "protobuf" and kind == COMPRESSED:
            return self._protobuf(message, change)
        if encoding == "protobuf" and kind == SPOT_IMAGE:
            return self._spot(message, change)
        if encoding == "json" and kind == COMPRESSED:
            return _json(message, change)
        raise Unreadable

    def counts(self) -> dict[str, object]:
        """How many pictures were searched, what was found in them, and what was left out, by topic or name."""
        searched = (("faces", self.finder, self.faces), ("texts", self.text, self.texts))
        every = (*searched, ("screens", self.screen, self.screens))
        found = {name: dict(sorted(count.items())) for name, finder, count in every if finder is not None}
        return {
            "pictures": dict(sorted(self.pictures.items())),
            **found,
            "left_out": dict(sorted(self.left_out.items())),
        }

    def keeps(self, attachment: Attachment) -> bool:
        """Whether an attachment stays: pictures and videos are left out."""
        if attachment.media_type.startswith(("image/", "video/")):
            self.left_out[attachment.name] += 1
            return False
        return True

    def _protobuf(self, message: Message, change: PictureChange) -> bytes | None:
        decoded = self._decoded(message)
        changed = change(bytes(decoded.data), message)
        if changed is None:
            return None
        decoded.data = changed
        return bytes(decoded.SerializeToString(deterministic=True))

    def _spot(self, message: Message, change: PictureChange) -> bytes | None:
        """An image response of Spot: most are stored without their pixels, and depth shows no face."""
        decoded = self._decoded(message)
        image = decoded.shot.image
        if not image.data or image.pixel_format == DEPTH_U16:
            return None
        changed = change(bytes(image.data), message)
        if changed is None:
            return None
        image.data = changed
        return bytes(decoded.SerializeToString(deterministic=True))

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

    def _search(self, data: bytes, message: Message) -> None:
        """Notes what is found in an encoded picture, once."""
        topic, now_ns = message.topic, message.log_time
        key = (topic, now_ns, hash(data))
        if key in self._searched:
            return
        picture, _ = _opened(data)
        self._searched.add(key)
        self.pictures[topic] += 1
        for finder, count in ((self.finder, self.faces), (self.text, self.texts), (self.screen, self.screens)):
            boxes = () if finder is None else finder.boxes(picture)
            count[topic] += len(boxes)
            for box in boxes:
                insort(self._found[topic], (now_ns, box))

    def _blurred(self, data: bytes, message: Message) -> bytes | None:
        """An encoded picture with what is found in it or shortly before or after it blurred; None if nothing is."""
        self._search(data, message)
        found, now_ns, hold_ns = self._found[message.topic], message.log_time, round(HOLD_S * NANO)
        first = bisect_left(found, now_ns - hold_ns, key=lambda one: one[0])
        end = bisect_right(found, now_ns + hold_ns, key=lambda one: one[0])
        boxes = tuple(dict.fromkeys(box for _, box in found[first:end]))
        finder = self.finder or self.text or self.screen
        if not boxes or finder is None:
            return None
        picture, kind = _opened(data)
        return _encoded(finder.blurred(picture, boxes), kind)


def _json(message: Message, change: PictureChange) -> bytes | None:
    try:
        decoded = msgspec.json.decode(message.data, type=dict[str, Any])
        data = base64.b64decode(decoded["data"], validate=True)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError, KeyError, TypeError, binascii.Error) as error:
        raise Unreadable from error
    changed = change(data, message)
    if changed is None:
        return None
    return msgspec.json.encode({**decoded, "data": base64.b64encode(changed).decode()})


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
