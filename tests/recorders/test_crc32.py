"""Checksums of joined blocks are those that zlib computes over all their bytes."""

from __future__ import annotations

import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from recorders.mcap_io.crc32 import combined_crc


@given(first=st.binary(max_size=300), second=st.binary(max_size=300))
def test_a_combined_checksum_is_that_of_the_joined_bytes(first: bytes, second: bytes) -> None:
    assert combined_crc(zlib.crc32(first), zlib.crc32(second), len(second)) == zlib.crc32(first + second)


@pytest.mark.parametrize("size", [0, 1, 255, 256, 65_537, 131_072, 1_048_999, 5_000_000])
def test_long_blocks_too(size: int) -> None:
    first, second = b"a head", bytes(range(256)) * (size // 256) + bytes(size % 256)
    assert combined_crc(zlib.crc32(first), zlib.crc32(second), size) == zlib.crc32(first + second)
