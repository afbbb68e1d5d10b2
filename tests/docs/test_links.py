"""Links of README.md and the documentation: every local target and anchor exists."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from console_blocks import ROOT

GENERATED = (
    "reference/commands.md",
    "reference/tables.md",
    "reference/events.md",
    "reference/api.md",
    "changelog.md",
)
_LINK = re.compile(r"(?<!`)!?\[[^\]]*\]\(([^)\s]+)\)|<img[^>]*\ssrc=\"([^\"]+)\"|<a[^>]*\shref=\"([^\"]+)\"")
_CODE = re.compile(r"^```.*?^```$|`[^`\n]*`", re.MULTILINE | re.DOTALL)
PAGES = [
    *sorted(ROOT.glob("*.md")),
    *sorted((ROOT / "docs").rglob("*.md")),
    *sorted((ROOT / "logs").glob("*.md")),
    *sorted((ROOT / "examples").rglob("*.md")),
]


def _links(page: Path) -> list[str]:
    text = _CODE.sub("", page.read_text(encoding="utf-8"))
    return [next(group for group in match.groups() if group) for match in _LINK.finditer(text)]


def _anchors(page: Path) -> set[str]:
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    headings = re.findall(r"^#+\s+(.*)$", text, re.MULTILINE)
    return {re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", h).strip().lower()) for h in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    for link in _links(page):
        if link.startswith(("http://", "https://", "mailto:")):
            assert re.match(r"https?://[\w.-]+\.[a-z]{2,}(/|$)", link) or link.startswith("mailto:"), link
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        docs = ROOT / "docs"
        if target.is_relative_to(docs) and str(target.relative_to(docs)) in GENERATED:
            continue
        assert target.exists(), f"{page.relative_to(ROOT)} links to {link}, which is not there"
        assert target.is_relative_to(ROOT), f"{link} leads out of the project"
        if anchor and target.suffix == ".md":
            assert anchor in _anchors(target), f"{link}: no heading {anchor} in {target.name}"


def test_every_page_of_docs_is_in_the_navigation() -> None:
    nav = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:")[2]
    pages = [str(p.relative_to(ROOT / "docs")) for p in sorted((ROOT / "docs").rglob("*.md"))]
    assert [page for page in (*pages, *GENERATED) if page not in nav] == []


def test_every_finding_has_one_row_in_the_tables_and_every_row_its_script() -> None:
    rows = re.findall(
        r"^\| `(findings/\S+\.sh)` \|", (ROOT / "docs" / "findings.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    assert sorted(rows) == sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "findings").glob("*.sh"))
