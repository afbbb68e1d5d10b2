"""The architecture page: its tree lists the folders there are, its files exist, and its diffs apply to them."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("workbench", "recorders", "replayers", "dashboards")
PAGE = (ROOT / "docs/architecture.md").read_text(encoding="utf-8")


def _blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def test_tree_lists_every_folder_of_the_packages() -> None:
    (tree,) = _blocks("text")
    listed: list[str] = []
    parents: list[str] = []
    for line in tree.splitlines():
        match = re.match(r"( *)(\w+)/ {2,}\S", line)
        assert match, line
        parents = [*parents[: len(match[1]) // 2], match[2]]
        listed.append("/".join(parents))
    there = [init.parent for package in PACKAGES for init in (ROOT / package).rglob("__init__.py")]
    assert sorted(listed) == sorted(str(folder.relative_to(ROOT)) for folder in there)


def test_every_named_file_exists() -> None:
    prose = re.sub(r"^```.*?^```$", "", PAGE, flags=re.MULTILINE | re.DOTALL)
    named = set(re.findall(rf"`((?:{'|'.join(PACKAGES)}|tests|docs)/[\w/.]+\.\w+|pyproject\.toml)`", prose))
    assert len(named) > 25
    assert [name for name in sorted(named) if not (ROOT / name).is_file()] == []


def test_example_diffs_apply() -> None:
    """Lines that a diff keeps or removes are in the file, in this order; a file that it adds is not there yet."""
    diffs = _blocks("diff")
    assert len(diffs) == 6
    for diff in diffs:
        old, new, *lines = diff.splitlines()
        target = ROOT / new.removeprefix("+++ b/")
        if old == "--- /dev/null":
            assert not target.exists()
            continue
        rest = target.read_text(encoding="utf-8")
        for line in (line[1:] for line in lines if line[:1] in (" ", "-")):
            assert f"{line}\n" in rest, f"{target.name} has no line {line!r} here"
            rest = rest.partition(f"{line}\n")[2]
