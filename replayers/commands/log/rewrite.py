"""`lios log filter | merge | split | compact | convert`: makes logs from logs, with options as in the mcap CLI."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import click

from replayers.commands.log.options import (
    ChunkSize,
    End,
    Exclude,
    Force,
    Include,
    Json,
    Log,
    Output,
    Packing,
    Start,
    bar,
    message_filter,
    style_of,
    warn,
)
from workbench.errors import BadValue, Unsupported
from workbench.parameters import Argument, Option
from workbench.terminal import emit_json, say

if TYPE_CHECKING:
    from replayers.log_tools.faces.blurred_pictures import FaceBlur
    from replayers.log_tools.rewrite import RewriteReport


def filter_log(
    log: Log,
    output: Output,
    include: Include = None,
    exclude: Exclude = None,
    start: Start = "",
    end: End = "",
    attachments: Annotated[bool, Option(help="Keep attachments.")] = True,
    metadata: Annotated[bool, Option(help="Keep metadata.")] = True,
    blur_faces: Annotated[
        bool, Option("--blur-faces", help="Blur the faces that are found in pictures (extra opencv).")
    ] = False,
    blur_text: Annotated[
        bool,
        Option("--blur-text", help="Blur the text that is found in pictures, as on screens and papers (extra text)."),
    ] = False,
    blur_screens: Annotated[
        bool,
        Option("--blur-screens", help="Blur TVs, monitors, laptops and phones (extra opencv, and --screen-model)."),
    ] = False,
    screen_model: Annotated[
        Path | None,
        Option("--screen-model", help="The weights for --blur-screens; without them, it says where from."),
    ] = None,
    compression: Packing = "zstd",
    chunk_size: ChunkSize = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Copy the wanted topics and times to another log; unknown topics pass through untouched.

    With --blur-faces, --blur-text or --blur-screens, images that cannot be searched are left out. What is not found
    stays: check the copy before you give it away, or leave the cameras out.

    Examples:

        lios log filter run.mcap -o small.mcap -n '/camera/.*' -S 10 -E 60

        lios log filter run.mcap -o for-others.mcap --blur-faces --blur-text
    """
    from dataclasses import replace

    from replayers.log_tools.rewrite import filtered

    wanted = replace(message_filter(log, include, exclude, start, end), attachments=attachments, metadata=metadata)
    style = style_of(compression, chunk_size, force)
    if screen_model is not None and not blur_screens:
        raise BadValue("--screen-model", str(screen_model), "given with --blur-screens")
    if not blur_faces and not blur_text and not blur_screens:
        _report(filtered(log, output, wanted, style, bar("filter")), as_json)
        return
    from replayers.log_tools.faces.blurred_pictures import FaceBlur
    from replayers.log_tools.faces.face_finder import FaceFinder
    from replayers.log_tools.faces.screens.screen_finder import ScreenFinder
    from replayers.log_tools.faces.text_finder import TextFinder

    blur = FaceBlur(
        finder=FaceFinder() if blur_faces else None,
        text=TextFinder() if blur_text else None,
        screen=ScreenFinder(screen_model) if blur_screens else None,
    )
    done = filtered(log, output, wanted, style, bar("filter"), change=blur)
    _report_blurred(blur)
    _report(done, as_json, blur)


def _report_blurred(blur: FaceBlur) -> None:
    """What was searched for and found, on standard error."""
    faces = [] if blur.finder is None else [f"{blur.faces.total():,} faces"]
    texts = [] if blur.text is None else [f"{blur.texts.total():,} pieces of text"]
    screens = [] if blur.screen is None else [f"{blur.screens.total():,} screens"]
    left = "screens are not searched for" if blur.text is None else "pictures on screens are not searched for"
    told = (
        f"{blur.pictures.total():,} pictures searched, {' and '.join([*faces, *texts, *screens])} found and blurred"
    )
    say(told if screens else f"{told}; {left}")
    for topic, count in sorted(blur.left_out.items()):
        say(f"{topic}: {count:,} left out: pictures that cannot be searched")


def merge(
    logs: Annotated[list[Path], Argument(help="Logs, or the parts of one.")],
    output: Output,
    runs: Annotated[
        bool, Option("--runs", help="Each log is a separate run; split --by run separates them again.")
    ] = False,
    allow_duplicates: Annotated[
        bool, Option("--allow-duplicates", help="Keep differing metadata and attachments of the same name.")
    ] = False,
    compression: Packing = "zstd",
    chunk_size: ChunkSize = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Join logs by time: the parts of a split log, or a run with the camera log recorded beside it.

    Examples:

        lios log merge run_0000.mcap run_0001.mcap -o run.mcap

        lios log merge monday/*.mcap -o monday.mcap --runs
    """
    from replayers.log_tools.rewrite import merge_logs

    style = style_of(compression, chunk_size, force)
    done = merge_logs(
        logs, output, style, several_runs=runs, allow_duplicates=allow_duplicates, progress=bar("merge")
    )
    _report(done, as_json, left_out="{:,} repeats of them in other logs were not written again")


def split(
    log: Log,
    output: Output,
    every: Annotated[float | None, Option("--every", help="Seconds of log time per part.")] = None,
    size: Annotated[int | None, Option("--size", help="Bytes per part.")] = None,
    by: Annotated[str | None, Option("--by", help="run: a file for each run of merge --runs.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Cut a log into parts OUTPUT_0000.mcap, OUTPUT_0001.mcap, ...; each opens alone.

    Examples:

        lios log split run.mcap -o parts/run.mcap --every 60

        lios log split monday.mcap -o runs/run.mcap --by run
    """
    from replayers.log_tools.copy_log import LogLayout
    from replayers.log_tools.rewrite import split_log

    if by not in (None, "run"):
        raise BadValue("--by", by, "run")
    done = split_log(
        log, output, LogLayout(force=force), part_s=every, part_bytes=size, by_run=by == "run", progress=bar("split")
    )
    _report(done, as_json)


def compact(
    log: Log,
    output: Output,
    compression: Packing = "zstd",
    chunk_size: Annotated[int, Option("--chunk-size", help="Bytes of a chunk before compression.", min=1)] = 4 << 20,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Rewrite a log in a few large chunks: smaller, and faster to read, than one synced at every decision.

    Chunks of at least a quarter of that size, compressed as asked for, are copied as they are.

    Examples:

        lios log compact run.mcap -o small.mcap
    """
    from replayers.log_tools.rewrite import MessageFilter, filtered

    _report(filtered(log, output, MessageFilter(), style_of(compression, chunk_size, force), bar("compact")), as_json)


def convert(
    log: Log,
    output: Output,
    compression: Packing = "zstd",
    chunk_size: ChunkSize = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Convert a log, by the output's extension: .mcap with another compression, or .jsonl with every message decoded.

    Examples:

        lios log convert run.mcap -o run.jsonl

        lios log convert run.mcap -o plain.mcap --compression none
    """
    from replayers.log_tools.jsonl import to_lines
    from replayers.log_tools.rewrite import MessageFilter, filtered

    if output.suffix == ".jsonl":
        if chunk_size is not None or compression != "zstd":
            option, value = ("--compression", compression) if compression != "zstd" else ("--chunk-size", chunk_size)
            raise BadValue(option, value, "left out for .jsonl, which has neither chunks nor compression")
        _report(to_lines(log, output, force=force, progress=bar("convert")), as_json)
    elif output.suffix == ".mcap":
        _report(
            filtered(log, output, MessageFilter(), style_of(compression, chunk_size, force), bar("convert")), as_json
        )
    else:
        raise UnknownFormat(output)


class UnknownFormat(Unsupported):
    """An output file whose suffix is not a known format."""

    def __init__(self, output: Path) -> None:
        super().__init__(
            f"{output}: only .mcap and .jsonl can be written here; lios export writes .parquet and .csv."
        )


def _report(
    done: RewriteReport, as_json: bool, blur: FaceBlur | None = None, *, left_out: str = "{:,} left out"
) -> None:
    """Says what was written.

    Args:
        left_out: how many messages were not, and why.
    """
    if as_json:
        emit_json(
            {
                **({} if blur is None else {"blurred": blur.counts()}),
                "outputs": [{"file": str(path), "size_bytes": path.stat().st_size} for path in done.outputs],
                "messages": done.messages,
                "left_out": done.dropped,
                "damages": [{"offset": damage.offset, "what": damage.what} for damage in done.loss.damages],
                "parts_missing": list(done.parts_missing),
            }
        )
    for path in done.outputs:
        say(f"{path}: {path.stat().st_size:,} bytes")
    say(f"{done.messages:,} messages" + (f"; {left_out.format(done.dropped)}" if done.dropped else ""))
    for damage in done.loss.damages[:5]:
        warn(damage)
    if done.parts_missing:
        say(f"Not all parts of the recording were given: {', '.join(map(str, done.parts_missing))} missing.")
    if done.loss.loses_content:
        say("Something was lost; lios doctor shows what.")
    if done.loss.loses_content or done.parts_missing:
        raise click.exceptions.Exit(3)
