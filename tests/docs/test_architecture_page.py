"""The architecture page: its tree lists the folders there are, its files exist, and its diffs apply to them."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from sample_logs import write_toy_log

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


def _changed() -> dict[str, str]:
    """The files that the diffs change, as they are then; a file that a diff adds is not there yet."""
    made: dict[str, str] = {}
    for diff in _blocks("diff"):
        for part in re.split(r"^--- .*\n(?=\+\+\+ )", diff, flags=re.MULTILINE)[1:]:
            head, *lines = part.splitlines()
            name = head.removeprefix("+++ b/")
            target = ROOT / name
            rest = made.get(name, target.read_text(encoding="utf-8") if target.exists() else "")
            done = ""
            for hunk in "\n".join(lines).split("\n@@\n"):
                before = "".join(f"{line[1:]}\n" for line in hunk.splitlines() if line[:1] != "+")
                after = "".join(f"{line[1:]}\n" for line in hunk.splitlines() if line[:1] != "-")
                found = before in rest if before else not target.exists()
                assert found, f"{name} has no lines {before!r} here"
                passed, _, rest = rest.partition(before) if before else ("", "", "")
                done += passed + after
            made[name] = done + rest
    return made


def test_example_diffs_apply() -> None:
    assert len(_blocks("diff")) == 6
    changed = _changed()
    assert len(changed) == 11
    for name, text in changed.items():
        if name.endswith(".py"):
            ast.parse(text)
        else:
            tomllib.loads(text)


EXTENDED = """
from pathlib import Path

from dashboards.capsule.write import capsule_page
from dashboards.model.scene import scene_at
from dashboards.model.timeline import timeline_of
from dashboards.tabs import SCENE_PANELS, TABS
from replayers.runs.run import read
from workbench.beliefs.estimators import ESTIMATORS, estimator
from workbench.execution.events import DoorPassed
from workbench.log_schema.codec import decode, encode, to_wire
from workbench.log_schema.events import TOPIC_OF
from workbench.planning.strategies import STRATEGIES, strategy
from workbench.registered_names import registered_names

assert strategy("opt-probable").name == "opt-probable"
assert estimator("flat").name == "flat"
assert [n.name for n in registered_names("strategies")][: len(STRATEGIES)] == list(STRATEGIES)
assert [n.name for n in registered_names("estimators")][: len(ESTIMATORS)] == list(ESTIMATORS)
(wire,) = to_wire(DoorPassed(stamp_ns=5, decision=1, open=False))
assert decode(TOPIC_OF[type(wire)], encode(wire)) == wire
run = read(Path("run.mcap"))
assert run.tables.decisions.shape[0] == len(run.plans)
timeline = timeline_of(run)
assert capsule_page([timeline])
assert "Walked" in SCENE_PANELS["doors"](scene_at(timeline, timeline.end_ns), timeline)
assert ("doors", "Doors") in TABS
"""


@pytest.mark.ci
def test_a_copy_with_all_diffs_works(tmp_path: Path) -> None:
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    for name, text in _changed().items():
        if name.startswith(PACKAGES):
            (tmp_path / name).write_text(text, encoding="utf-8")
    write_toy_log(tmp_path / "run.mcap")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n{EXTENDED}"
    ran = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
