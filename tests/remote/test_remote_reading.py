"""Reading at addresses: the bytes are those of the file, and no more are asked for than a reader needs."""

from __future__ import annotations

import io
import random
from pathlib import Path

import pytest
from web_server import web_server

from workbench.remote.path import RemotePath, path_of
from workbench.remote.reading import BLOCK_BYTES, MAX_AHEAD, open_remote

fsspec = pytest.importorskip("fsspec")


def test_any_reads_give_the_bytes_of_the_file(tmp_path: Path) -> None:
    data = random.Random(0).randbytes(3 * BLOCK_BYTES * MAX_AHEAD // 2 + 7)
    fsspec.filesystem("memory").pipe("/reading/data", data)
    chance = random.Random(1)
    local = io.BytesIO(data)
    with open_remote(_remote("memory://reading/data")) as stream:
        for _ in range(300):
            if chance.random() < 0.5:
                at = chance.randrange(len(data) + 100)
                stream.seek(at)
                local.seek(at)
            size = chance.choice((0, 1, 9, 1000, BLOCK_BYTES, 5 * BLOCK_BYTES))
            assert stream.read(size) == local.read(size)
            assert stream.tell() == local.tell() or local.tell() > len(data)
        stream.seek(0)
        assert stream.read() == data


def test_reading_on_takes_few_requests_and_jumping_about_few_bytes(tmp_path: Path) -> None:
    pytest.importorskip("aiohttp")
    (tmp_path / "data").write_bytes(bytes(32 << 20))
    with web_server(tmp_path) as server:
        with open_remote(_remote(f"{server.address}/data")) as stream:
            while stream.read(100_000):
                pass
        assert server.requests <= 20
        assert server.bytes_sent <= (32 << 20) + BLOCK_BYTES
        server.bytes_sent = 0
        with open_remote(_remote(f"{server.address}/data")) as stream:
            for at in range(20):
                stream.seek(at * 1_000_000)
                stream.read(9)
        assert server.bytes_sent <= 20 * 2 * BLOCK_BYTES


def _remote(address: str) -> RemotePath:
    path = path_of(address)
    assert isinstance(path, RemotePath)
    return path
