"""What becomes HTML is made of templates that stand in the code: no name of a log can become markup."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import pytest
from markupsafe import Markup
from product_source import modules

from dashboards.panels.markup import html, table, text

TAG = re.compile(r"</?[a-z][^<>]*>|<[a-z]+ [a-z-]+=")
HOSTILE = "<script>alert('x')</script>"


def test_text_is_escaped_and_markup_is_kept() -> None:
    assert html("<b>{}</b>", HOSTILE) == "<b>&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;</b>"
    assert html("<b>{}{}</b>", html("<i>{}</i>", "&"), 3) == "<b><i>&amp;</i>3</b>"
    assert html("{}", "a\u202eb") == "a\ufffdb", "text does not turn the direction of other text"
    assert text(html("{}", HOSTILE)) != HOSTILE


def test_cells_of_tables_are_text_unless_they_are_markup() -> None:
    shown = table(("head",), [[HOSTILE], [Markup("<b>1</b>")]], key=HOSTILE)
    assert "<script>" not in shown
    assert "<b>1</b>" in shown


@pytest.mark.ci
def test_no_markup_is_put_together_by_hand() -> None:
    found = [
        f"{name}: {fault}"
        for name, tree in modules().items()
        if name.startswith("dashboards/")
        for fault in faults(tree)
    ]
    assert found == [], "make it with dashboards.panels.markup.html"


@pytest.mark.parametrize(
    "source",
    [
        "x = f'<b>{name}</b>'",
        "x = '<b>' + name + '</b>'",
        "from html import escape",
        "x = Markup(name)",
        "html(name)",
    ],
)
def test_each_way_of_putting_it_together_by_hand_is_found(source: str) -> None:
    assert list(faults(ast.parse(source)))


def test_templates_are_allowed() -> None:
    assert list(faults(ast.parse("x = html('<b>{}</b>', name) + Markup('<i>a</i>')"))) == []


def faults(tree: ast.Module) -> Iterator[str]:
    made: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            made.add(id(node.value))  # a docstring
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("html", "Markup") and node.args:
            template = node.args[0]
            if isinstance(template, ast.Constant):
                made.add(id(template))
            elif ast.unparse(template).split("(")[0] not in ("resource", "re.sub", "template"):
                yield ast.unparse(node)
        if isinstance(node, ast.ImportFrom) and node.module == "html":
            yield ast.unparse(node)
    for node in ast.walk(tree):
        if id(node) not in made and TAG.search(_literal(node)):
            yield ast.unparse(node)


def _literal(node: ast.AST) -> str:
    """The text of a string or an f-string, but of no pattern with named groups; "" of anything else."""
    if isinstance(node, ast.JoinedStr):
        return "".join(str(v.value) if isinstance(v, ast.Constant) else "x" for v in node.values)
    literal = node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""
    return "" if "(?P<" in literal else literal
