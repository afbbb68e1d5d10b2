"""Outcomes are enumerations with messages: every field is filled in, and no check returns "" or a sentence."""

from __future__ import annotations

import ast
import string
from collections import Counter
from collections.abc import Iterable, Iterator

import pytest
from product_source import modules

from workbench.message_enum import MessageEnum, Result


class Door(MessageEnum):
    OPEN = ""
    LOCKED = "{door} is locked by {person}"


def test_a_result_says_its_message_with_the_details() -> None:
    locked = Door.LOCKED.result(door="the {door}", person="Ada")
    assert (locked.kind, locked.message) == (Door.LOCKED, "the {door} is locked by Ada")
    assert Door.OPEN.result().message == ""
    assert Door.OPEN.result() == Result(kind=Door.OPEN)


def _messages(trees: Iterable[tuple[str, ast.Module]]) -> dict[str, str]:
    """The message of every member of a MessageEnum, by "Enumeration.MEMBER"."""
    found: dict[str, str] = {}
    for _, tree in trees:
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef) and any(ast.unparse(base) == "MessageEnum" for base in node.bases):
                for part in node.body:
                    if isinstance(part, ast.Assign):
                        found[f"{node.name}.{ast.unparse(part.targets[0])}"] = ast.literal_eval(part.value)
    return found


def test_no_member_is_an_alias_of_another() -> None:
    counts = Counter((member.partition(".")[0], message) for member, message in _messages(modules().items()).items())
    assert counts
    assert [key for key, count in counts.items() if count > 1] == []


def test_every_field_of_a_message_is_filled_in() -> None:
    trees = modules().items()
    messages, used, wrong = _messages(trees), set[str](), list[str]()
    for name, tree in trees:
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and ast.unparse(node) in messages:
                used.add(ast.unparse(node))
            if not isinstance(node, ast.Call) or not ast.unparse(node.func).endswith(".result"):
                continue
            member = ast.unparse(node.func).removesuffix(".result")
            if member in messages:
                fields = {field for _, field, _, _ in string.Formatter().parse(messages[member]) if field is not None}
                if {keyword.arg for keyword in node.keywords} != fields:
                    wrong.append(f"{name}:{node.lineno}: {member} has the fields {sorted(fields)}")
    assert wrong == []
    assert set(messages) - used == set()


TEXTS = {
    "dashboards/capsule/write.py _left_out_note": "a note of the page, where something was left out",
    "dashboards/library/run_table.py _replayed": "the name of a log",
    "dashboards/palette.py run_number": "a sign beside a name",
    "dashboards/panels/beliefs.py _left": "a part of a cell, where a look could have missed the item",
    "dashboards/panels/folder/runs.py _arrow": "a sign in a heading",
    "dashboards/model/run_names.py _replay": "a part of a run's name",
    "dashboards/model/scene.py _automatic_focus": "the name of an item type",
    "recorders/spot/run/event_text.py NextStep.after": "a line of the live status",
    "recorders/spot/session/inferred_actions.py ActionDeriver._opened_by": "a value of the log",
    "replayers/batch/verify.py _recorded_by": "a part of a sentence",
    "replayers/commands/verify_logs.py recorded_as": "the name of a strategy",
    "replayers/counterfactual/overlooked.py misses_note": "a note of a replay",
    "replayers/importers/clocks.py BagClock.note": "a line of the report, made of enumerations",
    "replayers/live/ghost_bounds.py verdict_line": "a sentence with figures; the verdict itself is an enumeration",
    "replayers/live/ghosts.py Ghosts._rebased": "a note of a report",
    "replayers/log_tools/copy_log.py profile_of": "a value of the log's header",
    "replayers/log_tools/rewrite.py _common_profile": "a value of the log's header",
    "replayers/selection/verdict_text.py _of_the_safest": "a part of a sentence with figures",
    "replayers/selection/verdict_text.py _why_not_the_cheapest": "a sentence with figures",
    "workbench/beliefs/memory/history.py _change": "a cell of a table",
    "workbench/evaluation/statistics.py intervals_in_words": "a line below a table",
    "workbench/planning/strategies.py solver_in": "a part of a name",
}
"""Functions that return text of one kind, "" where there is none of it: parts of a text, and values."""


def _named_functions(node: ast.AST, owner: str = "") -> Iterator[tuple[str, ast.FunctionDef]]:
    for part in ast.iter_child_nodes(node):
        if isinstance(part, ast.FunctionDef):
            yield f"{owner}{part.name}", part
        name = f"{part.name}." if isinstance(part, ast.ClassDef) else owner
        yield from _named_functions(part, name)


def _returned(function: ast.FunctionDef) -> Iterator[ast.expr]:
    """What a function returns, both sides of a condition, without functions inside it."""
    waiting: list[ast.AST] = list(function.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.Lambda | ast.ClassDef):
            continue
        if isinstance(node, ast.Return) and node.value is not None:
            values = [node.value]
            while values:
                value = values.pop()
                if isinstance(value, ast.IfExp):
                    values += [value.body, value.orelse]
                else:
                    yield value
        waiting += ast.iter_child_nodes(node)


def empty_or_text(function: ast.FunctionDef) -> bool:
    """Whether a function returns "" at one place and other text at another."""
    if function.returns is None or ast.unparse(function.returns) != "str":
        return False
    empty = [isinstance(value, ast.Constant) and value.value == "" for value in _returned(function)]
    return any(empty) and not all(empty)


@pytest.mark.parametrize(
    ("body", "found"),
    [
        ('if x:\n  return "no way"\n return ""', True),
        ('return f"{x} is missing" if x else ""', True),
        ('return why(x) if x else ""', True),
        ('return f"{x}"', False),
        ('return ""', False),
        ('def f():\n  return ""\n return "a"', False),
    ],
)
def test_what_counts_as_empty_or_text(body: str, found: bool) -> None:
    (function,) = ast.parse(f"def check(x) -> str:\n {body}").body
    assert isinstance(function, ast.FunctionDef)
    assert empty_or_text(function) is found


def test_no_check_returns_nothing_or_a_sentence() -> None:
    found = {
        f"{name} {function}"
        for name, tree in modules().items()
        for function, node in _named_functions(tree)
        if empty_or_text(node)
    }
    assert found == set(TEXTS), "an outcome is a MessageEnum; what only builds text is listed here"
