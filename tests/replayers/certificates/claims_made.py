"""Certificates of the shipped logs for tests, and the checker, which imports nothing of this project."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

from replayers.certificates.build import certificate
from replayers.certificates.claim import sealed, write_claim
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.runs.run import read
from workbench.planning.strategies import strategy

ROOT = Path(__file__).resolve().parents[3]
CHECKER = ROOT / "tools" / "check_claim.py"
LOGS = ROOT / "logs"


@lru_cache(maxsize=64)
def checker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("check_claim", CHECKER)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@lru_cache(maxsize=64)
def facts(log: str) -> Any:
    return checker().Log(str(LOGS / f"{log}.mcap"))


@lru_cache(maxsize=64)
def claimed(log: str, name: str, most: int = 5000) -> str:
    prepared = prepare_log(read(LOGS / f"{log}.mcap"), ReplaySettings(worlds=0), with_paths=False)
    return json.dumps(sealed(certificate(prepared, strategy(name), max_branches=most)))


def written(folder: Path, logs: Sequence[str], names: Sequence[str]) -> list[str]:
    """The logs, and certificates of each strategy over each of them in a folder, as arguments of the checker."""
    paths = [str(LOGS / f"{log}.mcap") for log in logs]
    for name in names:
        for log in logs:
            paths.append(str(folder / f"{name}-{log}.lios.zip"))
            write_claim(Path(paths[-1]), json.loads(claimed(log, name)))
    return paths
