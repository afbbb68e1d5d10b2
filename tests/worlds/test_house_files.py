"""Files that are not houses are refused with one line, in bounded memory."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import pytest
from procthor_house import two_rooms

from workbench.cli import run as lios
from workbench.errors import BadValue, FileMissing, InputError, MalformedFile
from workbench.worlds.procthor.house_files import (
    MAX_LINE_BYTES,
    HouseIndexMissing,
    HouseIndexOutOfRange,
    split_address,
)
from workbench.worlds.procthor.load import load_house, load_houses
from workbench.worlds.shipped import house_file, shipped_houses


@pytest.fixture
def three(tmp_path: Path) -> Path:
    path = tmp_path / "my houses [a].jsonl.gz"
    path.write_bytes(gzip.compress((json.dumps(two_rooms()) + "\n").encode() * 3))
    return path


def test_each_layout_of_file(three: Path, tmp_path: Path) -> None:
    plain, single = tmp_path / "h.jsonl", tmp_path / "h.json"
    plain.write_text(json.dumps(two_rooms()) + "\n\n" + json.dumps(two_rooms()))
    single.write_text(json.dumps(two_rooms(), indent=1))
    assert [h.plan.name for h in load_houses(three)] == [f"my houses [a]:{i}" for i in range(3)]
    assert [h.plan.name for h in load_houses(plain)] == ["h:0", "h:1"]
    assert load_house(str(single)).plan.name == "h:0"
    assert load_house(f"{plain}:1").plan.name == "h:1"


def test_a_missing_file_and_a_missing_index(three: Path, tmp_path: Path) -> None:
    with pytest.raises(FileMissing, match="nowhere"):
        load_house(f"{tmp_path}/nowhere.jsonl.gz:3")
    with pytest.raises(FileMissing, match="nowhere"):
        load_house("nowhere")
    with pytest.raises(HouseIndexOutOfRange, match="It holds 3"):
        load_house(f"{three}:3")
    with pytest.raises(HouseIndexMissing, match="Say which one"):
        load_house(str(three))


@pytest.mark.parametrize("index", ["-1", "x", "", "1.5", "٣", "9" * 5000])
def test_an_index_that_is_none(three: Path, index: str) -> None:
    with pytest.raises((BadValue, FileMissing)):
        load_house(f"{three}:{index}")


def test_a_truncated_gzip(three: Path) -> None:
    data = three.read_bytes()
    three.write_bytes(data[: len(data) // 2])
    with pytest.raises(MalformedFile, match="ends too early"):
        load_houses(three)


def test_a_gzip_that_is_none(three: Path) -> None:
    three.write_bytes(b"not gzip at all")
    with pytest.raises(MalformedFile, match="no valid gzip"):
        load_houses(three)


def test_a_damaged_gzip(three: Path) -> None:
    data = bytearray(three.read_bytes())
    data[len(data) // 2] ^= 0xFF
    three.write_bytes(bytes(data))
    with pytest.raises(InputError):
        load_houses(three)


def test_a_gzip_bomb_is_not_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "bomb.jsonl.gz"
    with gzip.open(path, "wb", compresslevel=1) as stream:
        for _ in range(MAX_LINE_BYTES // 2**20 + 2):
            stream.write(b" " * 2**20)
    with pytest.raises(MalformedFile, match="longer than 64 MiB"):
        load_houses(path)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "holds no house"),
        ("\n\n", "holds no house"),
        ("{", "is no house"),
        ("[1, 2]", "is no house"),
        ("{}", "is no house"),
        ('{"rooms": NaN}', "holds NaN"),
        ('{"rooms": [-Infinity]}', "holds -Infinity"),
        ("[" * 100_000, "is no house"),
        ("\udcff", "is no house"),
    ],
)
def test_text_that_is_no_house(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "bad.jsonl"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(MalformedFile, match=says) as refused:
        load_houses(path)
    assert "\n" not in str(refused.value)


def test_a_folder_is_no_file_of_houses(tmp_path: Path) -> None:
    folder = tmp_path / "x.jsonl"
    folder.mkdir()
    with pytest.raises(MalformedFile, match="a folder"):
        load_houses(folder)


def test_a_file_named_with_a_colon(tmp_path: Path) -> None:
    path = tmp_path / "odd:7.json"
    path.write_text(json.dumps(two_rooms()))
    assert split_address(str(path)) == (path, None)


def test_a_shipped_house_is_found_by_the_name_that_logs_give_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert split_address("houses:9") == (shipped_houses(), 9)
    assert load_house("houses:9").plan.name == "houses:9"


def test_an_asset_table_that_is_none(three: Path, tmp_path: Path) -> None:
    table = tmp_path / "assets.csv"
    for text in ("a,b\n1,2\n", "asset_id,object_type,size_x_m,size_y_m,size_z_m\nBed_1,Bed,nan,1,1\n"):
        table.write_text(text)
        with pytest.raises(MalformedFile, match="no asset table"):
            load_house(f"{three}:0", assets=table)
    with pytest.raises(FileMissing):
        load_house(f"{three}:0", assets=tmp_path / "none.csv")


def test_every_command_that_takes_files_of_houses_takes_the_shipped_ones_by_their_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "houses").mkdir()  # a folder is no file of houses
    assert split_address("houses") == (shipped_houses(), None)
    for line in (
        ["houses", "info", "houses"],
        ["evaluate", "replay", "--houses", "houses", "-n", "1", "--dry-run"],
        ["evaluate", "select", "--houses", "houses", "--dry-run"],
        ["evaluate", "tasks", "--houses", "houses", "--scenarios", "coffee", "--dry-run"],
        ["evaluate", "search", "--houses", "houses", "--queries", "1", "--dry-run"],
        ["evaluate", "belief", "--houses", "houses", "--estimators", "counts"],
        ["train", "--houses", "houses", "--estimator", "counts", "--seed", "0", "-o", "counts.safetensors"],
    ):
        assert lios(line) == 0, (line, capsys.readouterr().err)
    assert lios(["evaluate", "replay", "--houses", "mine", "--dry-run"]) == 2
    assert house_file(Path("mine")) == Path("mine")
    (tmp_path / "houses").rmdir()
    (tmp_path / "houses").touch()
    assert house_file(Path("houses")) == Path("houses"), "a file that is there is meant itself"
