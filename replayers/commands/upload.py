"""`lios upload`: copies logs, replays and other results to an address."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from workbench.errors import BadValue
from workbench.options import Force, Json
from workbench.parameters import Argument


def upload(
    where: Annotated[list[str], Argument(help="Files and folders of this machine, and last the address to copy to.")],
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Copy files and folders to an address, such as a bucket: s3://, gs://, and others that fsspec knows.

    A single file is stored under the address itself, unless that ends with a slash; the contents of a folder go below
    it.

    Examples:

        lios upload run.mcap s3://bucket/runs/

        lios upload replays/ gs://bucket/replays
    """
    from workbench.remote.upload import upload as sent
    from workbench.terminal import counted, emit_json, progress, say

    *sources, address = where
    if not sources:
        raise BadValue("the address", None, "given after the files: lios upload run.mcap s3://bucket/runs/")
    there = sent(
        list(map(Path, sources)), address, force=force, progress=lambda pairs: progress(pairs, title="upload")
    )
    copies = [str(copy) for copy in there]
    if as_json:
        emit_json({"copies": copies})
    else:
        say(f"Sent {copies[0]}" if len(copies) == 1 else f"Sent {counted(len(copies), 'file')} to {address}")
