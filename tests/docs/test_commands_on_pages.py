"""Commands of README.md and the documentation: what a reader needs besides `make demo` is said on the page."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from console_blocks import ROOT, blocks_of

ADVICE = "The program's own advice, such as `pip install\n'lios-workbench[spot]'`"
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def _commands(page: Path) -> list[str]:
    return [command.text for block in blocks_of(page) for command in block.commands]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_extras_are_installed_from_the_clone_since_the_package_is_on_no_index(page: Path) -> None:
    said = page.read_text(encoding="utf-8").replace(ADVICE, "")
    assert re.findall(r"pip install[\s\\]+'?lios-workbench\[\w+", said) == []


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_a_page_with_commands_for_a_spot_names_their_extra(page: Path) -> None:
    if any(re.search(r"lios (evaluate )?spot\b", command) for command in _commands(page)):
        assert "'.[spot]'" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_no_pattern_of_a_page_catches_files_of_other_pages(page: Path) -> None:
    assert [command for command in _commands(page) if re.search(r"\s\*\.", command)] == []


def test_the_readme_says_where_the_houses_come_from_that_do_not_ship() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "train-on-procthor-10k.md#get-the-houses" in text[: text.index("--houses procthor/")]
