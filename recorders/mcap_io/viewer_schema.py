"""JSON Schemas in the subset that Foxglove and Lichtblick read.

Their parser takes an object at the root whose properties are booleans, strings, numbers, integers, objects, or
arrays of one of these; with one property of another kind it skips the whole channel. So references are resolved, and
what the subset cannot express (arrays of arrays) is left out of the description: it is in
the messages all the same, and in the exact schema. A value that may be null has its own type: events leave it out.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

SCALARS = ("boolean", "string", "number", "integer")
KEPT = ("type", "title", "description", "contentEncoding")


def viewer_schema(exact: Mapping[str, Any]) -> dict[str, Any]:
    """The schema of an object, reduced to the subset of viewers; every value that the exact one allows fits it.

    Args:
        exact: a JSON Schema with `type: object` at its root, and its definitions in $defs.
    """
    reduced = _reduced(exact, exact.get("$defs", {}), ())
    if reduced is None or reduced["type"] != "object":
        raise ValueError("a schema for viewers has an object at its root")
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **reduced}


def _reduced(
    node: Mapping[str, Any], definitions: Mapping[str, Any], within: tuple[str, ...]
) -> dict[str, Any] | None:
    """A node in the subset; None for one that it cannot express."""
    if "$ref" in node:
        name = str(node["$ref"]).rpartition("/")[2]
        return None if name in within else _reduced(definitions[name], definitions, (*within, name))
    choices = [choice for choice in node.get("anyOf", ()) if choice.get("type") != "null"]
    if len(choices) == 1:
        return _reduced(choices[0], definitions, within)
    kind = node.get("type")
    kept = {key: node[key] for key in KEPT if key in node}
    if kind in SCALARS:
        return kept
    if kind == "object":
        return kept | _properties(node, definitions, within)
    if kind == "array":
        items = _items(node, definitions, within)
        return None if items is None else kept | {"items": items}
    return None


def _properties(node: Mapping[str, Any], definitions: Mapping[str, Any], within: tuple[str, ...]) -> dict[str, Any]:
    reduced = {name: _reduced(value, definitions, within) for name, value in dict(node.get("properties", {})).items()}
    properties = {name: value for name, value in reduced.items() if value is not None}
    required = [name for name in node.get("required", ()) if name in properties]
    return {"properties": properties} | ({"required": required} if required else {})


def _items(node: Mapping[str, Any], definitions: Mapping[str, Any], within: tuple[str, ...]) -> dict[str, Any] | None:
    """What an array holds, if it is one kind and no array itself."""
    given = node.get("prefixItems") or ([node["items"]] if isinstance(node.get("items"), Mapping) else [])
    kinds = [_reduced(item, definitions, within) for item in given]
    if not kinds or kinds[0] is None or any(kind != kinds[0] for kind in kinds):
        return None
    return None if kinds[0]["type"] == "array" else kinds[0]
