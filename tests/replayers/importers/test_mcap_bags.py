"""Bags in MCAP are read whatever their profile, order and other topics; what cannot be read is told."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from replayers.importers.bags import BagNotClosed, EmptyBag, NotABag, open_bag
from replayers.importers.packed_files import Packed
from replayers.runs.run import read
from workbench.cli import run as lios
from workbench.worlds.sites.site import Site, load_site

sys.path.insert(0, str(Path(__file__).parent))
from standing_bag import Standing, StandingBag

Messages = list[tuple[Any, Any, Any]]
Arrange = Callable[[Messages], Messages]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The MCAP file of a robot that stands at the countertop, and sees a bottle on it."""
    folder = tmp_path_factory.mktemp("bag") / "bag"
    StandingBag(folder, Standing(ros2=True)).write(load_site("paper_home"))
    return next(folder.glob("*.mcap"))


@pytest.fixture(scope="module")
def site() -> Site:
    return load_site("paper_home")


def rewritten(
    source: Path,
    target: Path,
    *,
    profile: str = "ros2",
    arrange: Arrange = list,
    odd_topics: bool = False,
    **options: Any,
) -> Path:
    """The same messages in another file; options are those of mcap's Writer."""
    with source.open("rb") as stream:
        found = [(schema, channel, message) for schema, channel, message in make_reader(stream).iter_messages()]
    target.parent.mkdir(exist_ok=True)
    with target.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.NONE, **options)
        writer.start(profile=profile)
        channels: dict[str, int] = {}
        for schema, channel, message in arrange(found):
            if channel.topic not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, "cdr", number)
            writer.add_message(channels[channel.topic], message.log_time, message.data, message.log_time)
        if odd_topics:
            for topic, encoding, text in (
                ("/events", "unknown", b"?"),
                ("/service", "ros2msg", b"%% no [definition"),
                ("/json", "jsonschema", b"{}"),
            ):
                number = writer.register_schema("odd_msgs/msg/Odd", encoding, text)
                kind = "json" if encoding == "jsonschema" else "cdr"
                writer.add_message(writer.register_channel(topic, kind, number), found[0][2].log_time, b"{}", 0)
        writer.finish()
    return target


def swapped(found: Messages) -> Messages:
    """Neighbours in exchanged places, as recorders write what arrives late."""
    return [each for i in range(0, len(found), 2) for each in reversed(found[i : i + 2])]


def answer_of(bag: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    log = folder / "log.mcap"
    assert (
        lios(["import", str(bag), "--site", "paper_home", "-m", "paper", "-s", "none", "-o", str(log), "--json"]) == 0
    )
    assert {o.container: [i.type for i in o.items] for o in read(log).observations} == {"countertop": ["WaterBottle"]}
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("profile", ["ros2", "", "px4"])
def test_any_profile_is_read_and_other_ones_are_named(
    profile: str, recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = answer_of(rewritten(recorded, tmp_path / "a.mcap", profile=profile), tmp_path, capsys)
    assert answer["profiles"] == ([] if profile == "ros2" else [profile])


def test_topics_whose_schema_cannot_be_parsed_are_skipped_and_told(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = answer_of(rewritten(recorded, tmp_path / "a.mcap", odd_topics=True), tmp_path, capsys)
    assert sorted(answer["skipped"]) == ["/events", "/json", "/service"]
    assert "encoded as json" in answer["skipped"]["/json"]
    assert "cannot be parsed" in answer["skipped"]["/service"]


@pytest.mark.ci_but(1)
@pytest.mark.parametrize(
    "options",
    [{"use_chunking": False}, {"index_types": "NONE"}, {"index_types": "CHUNK"}, {"use_statistics": False}],
    ids=["no chunks", "no indexes", "no message indexes", "no statistics"],
)
def test_neighbours_swapped_come_in_order_with_and_without_indexes(
    options: dict[str, Any], recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if "index_types" in options:
        from mcap.writer import IndexType

        options = {"index_types": IndexType[options["index_types"]]}
    bag = rewritten(recorded, tmp_path / "a.mcap", arrange=swapped, **options)
    with open_bag(bag) as opened:
        stamps = [message.stamp_ns for message in opened.messages(opened.topics)]
    assert len(stamps) == 151
    assert stamps == sorted(stamps)
    answer_of(bag, tmp_path, capsys)


def test_files_of_one_bag_that_overlap_in_time_are_merged(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Topics are split over the files."""
    folder = tmp_path / "split"
    rewritten(
        recorded, folder / "a.mcap", arrange=lambda found: [f for f in found if f[1].topic == "/ar_pose_marker"]
    )
    rewritten(
        recorded, folder / "b.mcap", arrange=lambda found: [f for f in found if f[1].topic != "/ar_pose_marker"]
    )
    with open_bag(folder) as opened:
        stamps = [message.stamp_ns for message in opened.messages(opened.topics)]
    assert stamps == sorted(stamps)
    assert answer_of(folder, tmp_path, capsys)["detections"]["placed"] == 75


def test_a_killed_recording_gets_the_way_out_and_that_way_works(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    killed = tmp_path / "killed" / "killed_0.mcap"
    killed.parent.mkdir()
    whole = rewritten(recorded, tmp_path / "whole.mcap", chunk_size=2000).read_bytes()
    killed.write_bytes(whole[: len(whole) * 9 // 10])
    with pytest.raises(BagNotClosed, match="lios recover"), open_bag(killed.parent):
        pass
    mended = tmp_path / "mended.mcap"
    assert lios(["recover", str(killed), "-o", str(mended)]) in (0, 3)
    capsys.readouterr()
    answer_of(mended, tmp_path, capsys)


def test_a_compressed_file_alone_gets_the_way_out(recorded: Path, tmp_path: Path) -> None:
    packed = tmp_path / "bag_0.mcap.zstd"
    shutil.copy(recorded, packed)
    for path in (packed, tmp_path):
        with pytest.raises(Packed, match="zstd -d"), open_bag(path):
            pass


def test_a_file_without_messages_and_one_of_no_ros_are_named(recorded: Path, tmp_path: Path) -> None:
    with pytest.raises(EmptyBag), open_bag(rewritten(recorded, tmp_path / "a.mcap", arrange=lambda _: [])):
        pass
    other = rewritten(recorded, tmp_path / "b.mcap", profile="mine", arrange=lambda _: [], odd_topics=False)
    other.unlink()
    with other.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="mine")
        number = writer.register_schema("a", "jsonschema", b"{}")
        writer.add_message(writer.register_channel("/a", "json", number), 1, b"{}", 1)
        writer.finish()
    with pytest.raises(NotABag, match=r"profile 'mine': no topic is ROS's"), open_bag(other):
        pass


def test_a_mapped_topic_in_another_encapsulation_is_refused_by_name(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def as_xcdr2(found: Messages) -> Messages:
        for _, _, message in found:
            message.data = b"\0\x07" + message.data[2:]
        return found

    bag = rewritten(recorded, tmp_path / "x.mcap", arrange=as_xcdr2)
    assert lios(["import", str(bag), "--site", "paper_home", "-m", "paper", "-o", str(tmp_path / "o.mcap")]) == 2
    told = capsys.readouterr().err
    assert "/tf" in told
    assert "XCDR2 (0x0007)" in told
    assert not (tmp_path / "o.mcap").exists()
