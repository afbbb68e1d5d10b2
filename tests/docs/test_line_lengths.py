"""Prose on pages is wrapped at 120 columns, outside tables, code and headings."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from console_blocks import ROOT

COLUMNS = 120
PAGES = (ROOT / "README.md", ROOT / "logs" / "README.md", *sorted((ROOT / "docs").rglob("*.md")))


def prose_of(text: str) -> Iterator[tuple[int, str]]:
    """The lines of a page that are prose, each with its number."""
    fenced = False
    for number, line in enumerate(text.splitlines(), start=1):
        if line.strip().startswith("```"):
            fenced = not fenced
        elif not fenced and not line.startswith(("    ", "|", "#", "<")):
            yield number, line


def long_lines(page: Path) -> list[str]:
    prose = prose_of(page.read_text())
    return [f"{page.relative_to(ROOT)}:{number}" for number, line in prose if len(line) > COLUMNS and " " in line]


def test_prose_is_wrapped() -> None:
    assert [line for page in PAGES for line in long_lines(page)] == []
