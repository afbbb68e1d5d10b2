"""Two recordings to one file: the second is refused, and the first goes on unharmed."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.reader import make_reader

from recorders.mcap_io.file import LogInUse
from recorders.mcap_io.writer import McapWriter

fcntl = pytest.importorskip("fcntl")


def test_the_second_is_refused_and_the_first_unharmed(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    first = McapWriter(path)
    before = path.stat().st_size
    with pytest.raises(LogInUse, match="another process"):
        McapWriter(path, force=True)
    assert path.stat().st_size == before
    first.close()
    with path.open("rb") as stream:
        assert make_reader(stream).get_summary() is not None


def test_afterwards_it_may_be_replaced(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(b"x" * 100_000)
    for _ in range(2):
        McapWriter(path, force=True).close()
    assert path.stat().st_size < 100_000
