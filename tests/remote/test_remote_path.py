"""Addresses as paths: what is kept of them, and what they answer."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

from workbench.errors import FileMissing
from workbench.remote.errors import NotAnAddress
from workbench.remote.path import RemotePath, path_of

fsspec = pytest.importorskip("fsspec")


@pytest.mark.parametrize(
    "text",
    ["https://host:8000/a/run.mcap", "s3://bucket/runs/run.mcap", "memory://runs/a.mcap", "gs://b/c d/%20.mcap?x=1"],
)
def test_address_is_kept_as_it_is_written(text: str) -> None:
    path = path_of(text)
    assert isinstance(path, RemotePath)
    assert str(path) == text
    assert str(path / "x") == f"{text}/x"
    assert str(path.parent) + "/" + path.name == text
    assert pickle.loads(pickle.dumps(path)) == path  # noqa: S301 - as worker processes are given it
    assert str(path_of(path)) == text


def test_other_texts_are_paths_of_this_machine() -> None:
    for text in ("run.mcap", "/a//b", "houses:9", "s3:/bucket/x", "C:/x"):
        assert not isinstance(path_of(text), RemotePath)
        assert path_of(text) == Path(text)
    assert path_of("file:///a/b%20c.mcap") == Path("/a/b c.mcap")


@pytest.mark.parametrize("text", ["s3://a//b.mcap", "https://h/./x", "s3://", "memory:///"])
def test_address_that_no_path_keeps_is_refused(text: str) -> None:
    with pytest.raises(NotAnAddress):
        path_of(text)


def test_what_is_there_and_what_is_not() -> None:
    files = fsspec.filesystem("memory")
    files.pipe("/there/b.mcap", b"12345")
    files.pipe("/there/deep/a.mcap", b"1")
    files.pipe("/there/deep/a.txt", b"1")
    there = path_of("memory://there")
    assert there.is_dir()
    assert not there.is_file()
    assert (there / "b.mcap").is_file()
    assert (there / "b.mcap").stat().st_size == 5
    assert [str(p) for p in there.rglob("*.mcap")] == ["memory://there/b.mcap", "memory://there/deep/a.mcap"]
    nothing = path_of("memory://nothing/a.mcap")
    assert not nothing.exists()
    assert not nothing.is_dir()
    with pytest.raises(FileMissing):
        nothing.stat()
