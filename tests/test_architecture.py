"""The direction of imports, and single points of access: one module writes MCAP, one reads it, one package imports
torch."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from importlinter.cli import lint_imports

ROOT = Path(__file__).resolve().parents[1]
PRODUCT = ("workbench", "recorders", "replayers", "dashboards")


def _sources() -> list[Path]:
    return sorted(path for room in PRODUCT for path in (ROOT / room).rglob("*.py"))


def _importers(pattern: str) -> list[str]:
    """Files in which a line imports what the pattern names."""
    line = re.compile(rf"^\s*(from|import)\s+({pattern})\b", re.MULTILINE)
    return [str(path.relative_to(ROOT)) for path in _sources() if line.search(path.read_text(encoding="utf-8"))]


def test_imports_point_one_way() -> None:
    assert lint_imports(config_filename=str(ROOT / "pyproject.toml"), no_cache=True) == 0


@pytest.mark.parametrize(
    ("what", "pattern", "allowed"),
    [
        ("torch", "torch", "workbench/beliefs/"),
        ("the MCAP writer", r"mcap\.writer|mcap\.well_known|mcap_protobuf\.writer", "recorders/"),
        ("the MCAP reader", r"mcap\.reader|mcap\.stream_reader|mcap_protobuf\.decoder", "replayers/"),
        ("Viser", "viser", "dashboards/"),
        ("Spot's client", "bosdyn", "recorders/spot/"),
    ],
)
def test_outside_things_have_one_door(what: str, pattern: str, allowed: str) -> None:
    strangers = [path for path in _importers(pattern) if not path.startswith(allowed)]
    assert not strangers, f"{what} is imported outside {allowed}"


def test_nothing_unpickles() -> None:
    forbidden = re.compile(
        r"^\s*(import|from)\s+(pickle|dill|shelve|joblib)\b|allow_pickle=True|weights_only=False", re.M
    )
    assert [p.name for p in _sources() if forbidden.search(p.read_text(encoding="utf-8"))] == []
