"""Training without torch, as in the default install: the error names what to install, before anything is computed."""

from __future__ import annotations

import gzip
from importlib import util
from pathlib import Path

import pytest

from workbench import cli
from workbench.worlds.shipped import shipped_houses


def test_it_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found = util.find_spec
    monkeypatch.setattr(
        "workbench.beliefs.training.train.find_spec", lambda name: None if name == "torch" else found(name)
    )
    houses = tmp_path / "few.jsonl"
    with gzip.open(shipped_houses(), "rt", encoding="utf-8") as stream:
        houses.write_text("".join(next(stream) for _ in range(3)), encoding="utf-8")
    out = tmp_path / "weights.safetensors"
    assert cli.run(["train", "--houses", str(houses), "-e", "fcnn", "-o", str(out), "--seed", "0"]) == 2
    assert "lios-workbench[train]" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.ci_but(1)
@pytest.mark.parametrize("estimator", ["counts", "best"])
def test_the_others_need_none(estimator: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("workbench.beliefs.training.train.find_spec", lambda name: None)
    houses = tmp_path / "few.jsonl"
    with gzip.open(shipped_houses(), "rt", encoding="utf-8") as stream:
        houses.write_text("".join(next(stream) for _ in range(3)), encoding="utf-8")
    out = tmp_path / "weights.safetensors"
    assert cli.run(["train", "--houses", str(houses), "-e", estimator, "-o", str(out), "--seed", "0"]) == 0
    assert out.exists()
