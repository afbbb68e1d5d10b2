"""The JSON Schemas in logs are in the subset that viewers read, and the exact ones stand beside, in docs/schemas."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
import pytest
from sample_logs import write_toy_log

from recorders.mcap_io.channels import json_channel, json_schema
from recorders.mcap_io.viewer_schema import viewer_schema
from recorders.spot.session.topics import TOPIC_OF_FACT, fact_channel
from replayers.mcap_io.reader import messages
from workbench.log_schema.events import TOPICS, schema_name

SCALARS = {"boolean", "string", "number", "integer"}
LOGS = Path(__file__).parents[2] / "logs"
EXACT = Path(__file__).parents[2] / "docs" / "schemas"


class Inner(msgspec.Struct):
    name: str


class Outer(msgspec.Struct, kw_only=True):
    count: int
    matrix: list[list[float]]
    perhaps: float | None = None
    point: tuple[float, float]
    mixed: tuple[int, str]
    inner: Inner
    more: list[Inner]
    counts: dict[str, int]
    data: bytes


def breaks_the_rules(schema: Mapping[str, Any], where: str = "") -> list[str]:
    """What the parser of Foxglove and Lichtblick refuses: it looks at an object's properties and at arrays' items."""
    if schema.get("type") != "object":
        return [f"{where or 'the root'} is no object"]
    found: list[str] = []
    for name, value in schema.get("properties", {}).items():
        path = f"{where}.{name}"
        items = value.get("items") if value.get("type") == "array" else None
        if value.get("type") == "object":
            found += breaks_the_rules(value, path)
        elif items is not None and items.get("type") == "object":
            found += breaks_the_rules(items, f"{path}[]")
        elif (items if items is not None else value).get("type") not in SCALARS:
            found.append(f"{path} is of an unsupported type: {value}")
    return found


def _keys(value: object) -> set[str]:
    if isinstance(value, dict):
        return set(value) | {key for part in value.values() for key in _keys(part)}
    return {key for part in value for key in _keys(part)} if isinstance(value, list) else set()


def test_every_json_channel_is_in_the_subset():
    for channel in (*map(json_channel, TOPICS.values()), *map(fact_channel, TOPIC_OF_FACT)):
        schema = json.loads(channel.schema_data)
        assert breaks_the_rules(schema) == [], channel.topic
        assert not _keys(schema) & {"$ref", "anyOf", "oneOf", "prefixItems", "$defs"}, channel.topic
        assert {"stamp"} <= set(schema["properties"]) or channel.topic == "/search/truth", channel.topic


def test_a_recorded_log_is_in_the_subset_and_its_messages_fit(tmp_path: Path):
    jsonschema = pytest.importorskip("jsonschema")
    checked = set[str]()
    for message in messages(write_toy_log(tmp_path / "a.mcap")):
        if message.channel.message_encoding == "json":
            assert message.schema is not None
            assert breaks_the_rules(json.loads(message.schema.data)) == []
            jsonschema.validate(json.loads(message.data), json.loads(message.schema.data))
            jsonschema.validate(json.loads(message.data), json_schema(TOPICS[message.topic]))
            checked.add(message.topic)
    assert {"/search/belief", "/search/plan", "/search/action", "/search/observation"} <= checked


@pytest.mark.parametrize("log", sorted(LOGS.glob("*.mcap")), ids=lambda log: log.stem)
def test_every_shipped_log_is_in_the_subset(log: Path):
    schemas = {m.topic: m.schema for m in messages(log) if m.channel.message_encoding == "json"}
    assert {"/search/belief", "/search/plan", "/search/action", "/search/observation"} <= set(schemas)
    for topic, schema in schemas.items():
        assert schema is not None, topic
        assert breaks_the_rules(json.loads(schema.data)) == [], topic


def test_the_exact_schemas_stand_beside():
    assert {path.stem for path in EXACT.glob("*.json")} == {schema_name(kind) for kind in TOPICS.values()}
    for kind in TOPICS.values():
        stands = json.loads((EXACT / f"{schema_name(kind)}.json").read_text())
        assert stands == json.loads(json.dumps(json_schema(kind))), kind


def test_by_hand_what_cannot_be_said_is_left_out():
    exact = msgspec.json.schema(Outer)
    reduced = viewer_schema(exact["$defs"]["Outer"] | {"$defs": exact["$defs"]})
    kinds = {name: value["type"] for name, value in reduced["properties"].items()}
    assert kinds == {
        "count": "integer", "perhaps": "number", "point": "array", "inner": "object", "more": "array",
        "counts": "object", "data": "string",
    }  # fmt: skip
    assert reduced["properties"]["data"]["contentEncoding"] == "base64"
    assert reduced["properties"]["more"]["items"]["properties"] == {"name": {"type": "string"}}
    assert set(reduced["required"]) == set(kinds) - {"perhaps"}
    assert breaks_the_rules(reduced) == []


def test_the_exact_schema_itself_is_refused():
    """So the rules here are not empty."""
    assert breaks_the_rules(json_schema(TOPICS["/search/belief"]))
