"""zstd frames that store their content: read without zstd, with both checksums; any other frame is left to zstd."""

from __future__ import annotations

import random
import zlib
from collections.abc import Callable

import pytest
import zstandard

from recorders.mcap_io.stored_frame import SINGLE_SEGMENT, store, stored_frame

PICTURES = random.Random(1).randbytes(1_300_000)


@pytest.mark.parametrize("size", [0, 1, 255, 256, 300, 65_536, 65_791, 131_072, 131_073, 1_300_000])
@pytest.mark.parametrize("level", [1, 3, 19])
def test_what_zstd_stores_is_read_with_both_checksums(size: int, level: int) -> None:
    content = PICTURES[:size]
    frame = zstandard.ZstdCompressor(level=level).compress(content)
    found = stored_frame(memoryview(frame))
    if (
        found is None
    ):  # zstd could compress a few bytes after all, or the content is longer than the window of its level
        assert len(frame) < size or not frame[4] & SINGLE_SEGMENT
        return
    assert found.content() == content
    assert found.content_bytes == size
    assert found.crc == zlib.crc32(content)
    assert found.frame_crc() == zlib.crc32(frame)


def test_a_frame_of_pictures_is_stored() -> None:
    assert stored_frame(zstandard.compress(PICTURES)) is not None


@pytest.mark.parametrize(
    "other",
    [
        lambda: zstandard.compress(b"text " * 1000),
        lambda: zstandard.ZstdCompressor(write_checksum=True).compress(PICTURES),
        lambda: zstandard.ZstdCompressor(write_content_size=False).compress(PICTURES),
        lambda: zstandard.compress(PICTURES) + b"x",
        lambda: zstandard.compress(PICTURES) * 2,
        lambda: zstandard.compress(PICTURES)[:-1],
        lambda: zstandard.compress(PICTURES)[:3],
        lambda: b"",
        lambda: PICTURES[:1000],
    ],
    ids=["compressed", "checksum", "no size", "rest", "two frames", "cut", "head", "empty", "no frame"],
)
def test_anything_else_is_left_to_zstd(other: Callable[[], bytes]) -> None:
    assert stored_frame(other()) is None


def test_no_flipped_byte_is_read_as_what_zstd_would_not_read() -> None:
    """Whatever is accepted, zstd reads alike; a flip in the content changes its checksum."""
    frame = zstandard.compress(PICTURES[:3000])
    for at in range(len(frame)):
        for bit in range(8):
            flipped = bytearray(frame)
            flipped[at] ^= 1 << bit
            found = stored_frame(bytes(flipped))
            if found is not None:
                assert found.content() == zstandard.ZstdDecompressor().decompress(
                    bytes(flipped), allow_extra_data=False
                )
                assert found.crc != zlib.crc32(PICTURES[:3000])


@pytest.mark.parametrize("size", [0, 1, 255, 256, 65_791, 131_072, 131_073, 1_300_000])
def test_what_is_stored_is_read_by_zstd_and_has_both_checksums(size: int) -> None:
    content = bytearray(PICTURES[:size])
    made = store(content)
    assert zstandard.ZstdDecompressor().decompress(bytes(made.frame), allow_extra_data=False) == content
    assert zstandard.frame_content_size(bytes(made.frame)) == size
    assert (made.crc, made.frame_crc()) == (zlib.crc32(content), zlib.crc32(made.frame))
    assert made.content() == content
