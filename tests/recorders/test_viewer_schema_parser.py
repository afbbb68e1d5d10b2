"""The parser of Foxglove Studio, which Lichtblick took over, reads the JSON channels of every shipped log.

It is the function parseJsonSchema of npm's @foxglove/studio-base 1.48.0, the last release that was published with its
sources readable; npm's @lichtblick/suite holds types only.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import tarfile
from pathlib import Path
from typing import Any

import pytest

from recorders.mcap_io.channels import json_schema
from replayers.mcap_io.reader import messages
from workbench.log_schema.events import TOPICS

PACKAGE = "@foxglove/studio-base@1.48.0"
LOGS = Path(__file__).parents[2] / "logs"
MESSAGES = 20
"""Messages of each channel that go through the parser's conversion."""


@pytest.fixture(scope="module")
def asset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of the package that holds the parser."""
    npm, node = shutil.which("npm"), shutil.which("node")
    if npm is None or node is None:
        pytest.skip("no npm and node here")
    folder = tmp_path_factory.mktemp("studio")
    try:
        done = subprocess.run(
            [npm, "pack", PACKAGE], cwd=folder, capture_output=True, text=True, check=False, timeout=240
        )
    except subprocess.TimeoutExpired:
        pytest.skip(f"npm is too slow to fetch {PACKAGE}")
    if done.returncode:
        pytest.skip(f"npm does not reach {PACKAGE}")
    with tarfile.open(next(folder.glob("*.tgz"))) as packed:
        for member in packed:
            if member.isfile() and member.name.startswith("package/assets/") and member.name.endswith(".js"):
                held = packed.extractfile(member)
                data = b"" if held is None or member.size > 1_000_000 else held.read()
                if b"function parseJsonSchema(" in data:
                    (folder / "asset.js").write_bytes(data)
                    return folder / "asset.js"
    pytest.skip(f"{PACKAGE} holds no readable parser")


def _parsed(asset: Path, channels: list[dict[str, Any]]) -> list[dict[str, Any]]:
    file = asset.with_name("channels.json")
    file.write_text(json.dumps([{k: v for k, v in channel.items() if k != "log"} for channel in channels]))
    script = Path(__file__).with_name("viewer_parser.mjs")
    done = subprocess.run(
        ["node", str(script), str(asset), str(file)], capture_output=True, text=True, check=True, timeout=120
    )
    return json.loads(done.stdout)


def _json_channels(log: Path) -> list[dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    for message in messages(log):
        if message.channel.message_encoding == "json":
            assert message.schema is not None
            channel = found.setdefault(
                message.topic,
                {"topic": message.topic, "name": message.schema.name, "schema": json.loads(message.schema.data)}
                | {"messages": []},
            )
            if len(channel["messages"]) < MESSAGES:
                channel["messages"].append(json.loads(message.data))
    return list(found.values())


@pytest.mark.slow
def test_the_parser_of_the_viewers_reads_all_json_channels_of_all_shipped_logs(asset: Path) -> None:
    logs = sorted(LOGS.glob("*.mcap"))
    channels: list[dict[str, Any]] = [channel | {"log": log} for log in logs for channel in _json_channels(log)]
    read: set[Path] = set()
    for sent, told in zip(channels, _parsed(asset, channels), strict=True):
        assert "error" not in told, (sent["log"], told)
        assert told["messages"] == len(sent["messages"]) > 0
        assert set(told["types"][sent["name"]]) == set(sent["schema"]["properties"]), sent["topic"]
        read.add(sent["log"])
    assert len(logs) >= 22
    assert read == set(logs)


@pytest.mark.slow
def test_the_parser_refuses_the_exact_schema(asset: Path) -> None:
    """So it is the parser that refused the logs of earlier releases."""
    exact = json_schema(TOPICS["/search/belief"])
    (told,) = _parsed(asset, [{"topic": "/search/belief", "name": "a", "schema": exact, "messages": []}])
    assert "Unsupported type" in told["error"]
