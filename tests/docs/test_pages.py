"""Every command and every Python block of the documentation runs, and prints what the page shows."""

from __future__ import annotations

from pathlib import Path

import pytest
from console_blocks import PROCTHOR, ROOT, Command, blocks_of, is_slow, missing, needs_procthor, prepare, run_page

PAGES = [p for p in sorted((ROOT / "docs").rglob("*.md")) if any(not b.skipped for b in blocks_of(p))]


def _cases(pages: list[Path]) -> list[object]:
    return [
        pytest.param(
            page,
            id=str(page.relative_to(ROOT)),
            marks=[pytest.mark.slow] if is_slow(page) else [pytest.mark.ci] if page.stem != "log-format" else [],
        )
        for page in pages
    ]


@pytest.mark.timeout(3000)
@pytest.mark.parametrize("page", _cases(PAGES))
def test_page_does_what_it_shows(page: Path, tmp_path: Path) -> None:
    if needs_procthor(page) and not PROCTHOR.exists():
        pytest.skip(f"no ProcTHOR houses at {PROCTHOR}")
    prepare(tmp_path)
    wrong = run_page(page, tmp_path)
    assert not wrong, "\n\n".join(wrong)


def test_the_tutorials_are_among_them() -> None:
    assert {p.stem for p in PAGES} >= {
        "first-run",
        "replay-your-own-planner",
        "train-on-procthor-10k",
        "spot-session",
        "three-field-trials",
    }


def test_a_loose_block_is_compared_but_for_its_numbers() -> None:
    shown = Command(
        text="lios evaluate search", shown=["│ lios │ 0.404 │", "┏━━━┓", "conditioned-lios saves -1.9 (95 %)"]
    )
    assert missing(shown, "│ lios   │ 12.5 │\n┏━━━━━┓\nconditioned-lios saves 0.2 (95 %)", loose=True) == []
    assert missing(shown, "│ lios │ +40.4 % │\n┏━━━┓\nconditioned-lios saves -1.9 (95 %)", loose=True) == [
        "│ lios │ 0.404 │"
    ]
    assert missing(shown, "│ lios │ 0.405 │\n┏━━━┓\nconditioned-lios saves -1.9 (95 %)", loose=False) == [
        "│ lios │ 0.404 │"
    ]
