"""Writes H.264 frames as an MP4 file: the boxes of ISO/IEC 14496-12 and -15 for one video track of constant rate."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass

MATRIX = struct.pack(">9I", 0x10000, 0, 0, 0, 0x10000, 0, 0, 0, 0x40000000)
"""No rotation."""


@dataclass(frozen=True, slots=True)
class Sample:
    """One encoded frame, NAL units with length prefixes; key: it can be decoded alone."""

    data: bytes
    key: bool


def mp4(samples: Sequence[Sample], description: bytes, *, width: int, height: int, frames_a_second: int) -> bytes:
    """The file.

    Args:
        description: the decoder's configuration (the content of an avcC box).
    """
    head = _box(b"ftyp", b"isom", struct.pack(">I", 0x200), b"isomiso2avc1mp41")
    # The movie box comes before the frames, so that a browser can start at once; its length does not depend on
    # where the frames begin, so it is built twice.
    moov = _moov(samples, description, width, height, frames_a_second, data_at=0)
    data_at = len(head) + len(moov) + 8
    moov = _moov(samples, description, width, height, frames_a_second, data_at=data_at)
    return head + moov + _box(b"mdat", *(sample.data for sample in samples))


def _box(kind: bytes, *parts: bytes) -> bytes:
    size = 8 + sum(len(part) for part in parts)
    return struct.pack(">I", size) + kind + b"".join(parts)


def _full(kind: bytes, *parts: bytes, flags: int = 0) -> bytes:
    return _box(kind, struct.pack(">I", flags), *parts)


def _moov(
    samples: Sequence[Sample], description: bytes, width: int, height: int, rate: int, *, data_at: int
) -> bytes:
    count = len(samples)
    mvhd = _full(
        b"mvhd",
        struct.pack(">IIII", 0, 0, rate, count),
        struct.pack(">IHHII", 0x10000, 0x100, 0, 0, 0),
        MATRIX,
        bytes(24),
        struct.pack(">I", 2),
    )
    tkhd = _full(
        b"tkhd",
        struct.pack(">IIIIIIIHHHH", 0, 0, 1, 0, count, 0, 0, 0, 0, 0, 0),
        MATRIX,
        struct.pack(">II", width << 16, height << 16),
        flags=3,
    )
    mdhd = _full(b"mdhd", struct.pack(">IIIIHH", 0, 0, rate, count, 0x55C4, 0))
    hdlr = _full(b"hdlr", struct.pack(">I4s", 0, b"vide"), bytes(12), b"LIOS workbench\0")
    dinf = _box(b"dinf", _full(b"dref", struct.pack(">I", 1), _full(b"url ", flags=1)))
    minf = _box(
        b"minf", _full(b"vmhd", bytes(8), flags=1), dinf, _samples_table(samples, description, width, height, data_at)
    )
    return _box(b"moov", mvhd, _box(b"trak", tkhd, _box(b"mdia", mdhd, hdlr, minf)))


def _samples_table(samples: Sequence[Sample], description: bytes, width: int, height: int, data_at: int) -> bytes:
    count = len(samples)
    entry = _box(
        b"avc1",
        bytes(6),
        struct.pack(">H", 1),
        bytes(16),
        struct.pack(">HHIIIH", width, height, 0x480000, 0x480000, 0, 1),
        bytes(32),
        struct.pack(">Hh", 24, -1),
        _box(b"avcC", description),
    )
    keys = [i + 1 for i, sample in enumerate(samples) if sample.key]
    return _box(
        b"stbl",
        _full(b"stsd", struct.pack(">I", 1), entry),
        _full(b"stts", struct.pack(">III", 1, count, 1)),
        _full(b"stss", struct.pack(f">I{len(keys)}I", len(keys), *keys)),
        _full(b"stsc", struct.pack(">IIII", 1, 1, count, 1)),
        _full(b"stsz", struct.pack(f">II{count}I", 0, count, *(len(sample.data) for sample in samples))),
        _full(b"stco", struct.pack(">II", 1, data_at)),
    )
