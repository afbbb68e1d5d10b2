"""Outcomes are enumerations with messages: every field is filled in, and no check returns "" or a sentence."""

from __future__ import annotations

import ast
import string
from pathlib import Path

from workbench.message_enum import MessageEnum, Result

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("workbench", "recorders", "replayers", "dashboards")


class Door(MessageEnum):
    OPEN = ""
    LOCKED = "{door} is locked by {person}"


def test_a_result_says_its_message_with_the_details() -> None:
    locked = Door.LOCKED.result(door="the {door}", person="Ada")
    assert (locked.kind, locked.message) == (Door.LOCKED, "the {door} is locked by Ada")
    assert Door.OPEN.result().message == ""
    assert Door.OPEN.result() == Result(kind=Door.OPEN)


def _trees() -> list[tuple[str, ast.Module]]:
    paths = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
    return [(path.relative_to(ROOT).as_posix(), ast.parse(path.read_text(encoding="utf-8"))) for path in paths]


def _messages(trees: list[tuple[str, ast.Module]]) -> dict[str, str]:
    """The message of every member of a MessageEnum, by "Enumeration.MEMBER"."""
    found: dict[str, str] = {}
    for _, tree in trees:
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef) and any(ast.unparse(base) == "MessageEnum" for base in node.bases):
                for part in node.body:
                    if isinstance(part, ast.Assign):
                        found[f"{node.name}.{ast.unparse(part.targets[0])}"] = ast.literal_eval(part.value)
    return found


def test_every_field_of_a_message_is_filled_in() -> None:
    trees = _trees()
    messages, used, wrong = _messages(trees), set[str](), list[str]()
    for name, tree in trees:
        for node in ast.walk(tree):
            called = node.func if isinstance(node, ast.Call) else None
            member = ast.unparse(called.value) if isinstance(called, ast.Attribute) else ""
            if isinstance(node, ast.Call) and ast.unparse(node.func) == f"{member}.result" and member in messages:
                used.add(member)
                fields = {field for _, field, _, _ in string.Formatter().parse(messages[member]) if field is not None}
                if {keyword.arg for keyword in node.keywords} != fields:
                    wrong.append(f"{name}:{node.lineno}: {member} has the fields {sorted(fields)}")
    assert wrong == []
    assert set(messages) - used == set()
