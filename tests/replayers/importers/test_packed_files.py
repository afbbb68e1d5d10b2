"""Files of bags that were compressed as a whole: frames are joined, what is cut off or too large is told."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import yaml
import zstandard

from replayers.importers import packed_files
from replayers.importers.bags import BagNotClosed, open_bag
from replayers.importers.packed_files import CutOffPacked, NoSpaceToUnpack, unpack_file
from workbench.cli import run as lios

ROOT = Path(__file__).resolve().parents[3]
CONTENT = bytes(range(256)) * 4000


class _Disk(NamedTuple):
    total: int
    used: int
    free: int


def a_packed_bag(folder: Path, data: bytes) -> Path:
    """A bag folder of one compressed file."""
    folder.mkdir()
    (folder / "bag_0.mcap.zstd").write_bytes(data)
    about: dict[str, Any] = {"compression_mode": "FILE", "relative_file_paths": ["bag_0.mcap.zstd"]}
    (folder / "metadata.yaml").write_text(yaml.safe_dump({"rosbag2_bagfile_information": about}), encoding="utf-8")
    return folder


def test_several_frames_are_one_file(tmp_path: Path) -> None:
    packed, plain = tmp_path / "a.zstd", tmp_path / "a"
    packed.write_bytes(zstandard.compress(CONTENT) + zstandard.compress(b"and more") + zstandard.compress(b""))
    unpack_file(packed, plain)
    assert plain.read_bytes() == CONTENT + b"and more"


@pytest.mark.parametrize("frames", [1, 2])
def test_a_file_that_ends_inside_a_frame_is_told_and_not_read_in_part(tmp_path: Path, frames: int) -> None:
    data = zstandard.compress(CONTENT) * frames
    bag = a_packed_bag(tmp_path / "bag", data[:-5])
    with pytest.raises(CutOffPacked, match=r"bag_0.mcap.zstd: cut off .* lios recover"), open_bag(bag):
        pass
    assert lios(["import", str(bag), "--site", "paper_home", "-o", str(tmp_path / "o.mcap")]) == 2


def test_a_killed_recording_that_was_compressed_is_named_by_its_own_file(tmp_path: Path) -> None:
    """Not by the temporary one, which is gone when the line is read."""
    whole = (ROOT / "logs" / "find-lios.mcap").read_bytes()
    bag = a_packed_bag(tmp_path / "bag", zstandard.compress(whole[: len(whole) // 2]))
    with pytest.raises(BagNotClosed) as caught, open_bag(bag):
        pass
    packed = bag / "bag_0.mcap.zstd"
    assert str(caught.value).startswith(f"{packed}: cut off")
    assert f"zstd -d {packed}, then lios recover {bag / 'bag_0.mcap'} " in str(caught.value)


@pytest.mark.parametrize("declared", [True, False])
def test_what_takes_more_room_than_the_disk_has_is_refused_and_leaves_nothing(
    tmp_path: Path, declared: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file of a few hundred bytes that unpacks to 40 MB, on a disk with 30 MB above what stays free."""
    free = packed_files.KEEP_FREE_BYTES + 30_000_000

    def usage(_: Path) -> _Disk:
        return _Disk(2 * free, free, free)

    monkeypatch.setattr(shutil, "disk_usage", usage)
    packed, plain = tmp_path / "a.mcap.zstd", tmp_path / "a.mcap"
    compressor = zstandard.ZstdCompressor(write_content_size=declared)
    packed.write_bytes(compressor.compress(bytes(40_000_000)))
    with pytest.raises(NoSpaceToUnpack, match=r"or more, and .* TMPDIR"):
        unpack_file(packed, plain)
    assert not plain.exists()
    packed.write_bytes(compressor.compress(bytes(20_000_000)))
    unpack_file(packed, plain)
    assert plain.stat().st_size == 20_000_000
