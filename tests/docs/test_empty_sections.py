"""Each section of a house, site, configurations or task file, left empty, is refused with one line."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from console_blocks import ROOT

from workbench import cli
from workbench.errors import InputError
from workbench.planning.scenarios.yaml_files import house_from_file, task_from_file
from workbench.worlds.house_yaml import load_house_yaml
from workbench.worlds.sites.configurations import configurations_of, load_configurations, site_and_house
from workbench.worlds.sites.site import load_site

SHIPPED = ROOT / "workbench" / "data" / "sites" / "paper_home"
OPTIONAL = {("containers", 0, "stand"), ("walls", 0, "room")}
"""May be null, as if they were not there."""
Key = str | int


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    assert cli.run(["new", "house", "flat"]) == cli.run(["new", "site", "lab"]) == 0
    shutil.copytree(SHIPPED, tmp_path / "home")
    return tmp_path


def read_task(path: Path) -> None:
    site = load_site(path.parent)
    _, house = site_and_house(site, configurations_of(site)["A"])
    house_from_file(path, house, seed=0)
    task_from_file(path, house, seed=0)


READERS: dict[str, Callable[[Path], object]] = {
    "flat.yaml": load_house_yaml,
    "lab/site.yaml": load_site,
    "home/site.yaml": load_site,
    "home/configurations.yaml": lambda path: load_configurations(path, load_site(path.parent)),
    "home/deliver.yaml": read_task,
}


@pytest.mark.parametrize("name", READERS)
def test_empty_sections_are_refused(name: str, folder: Path) -> None:
    path = folder / name
    whole = yaml.safe_load(path.read_text())
    READERS[name](path)
    keys = [keys for keys in sections(whole) if keys not in OPTIONAL]
    assert len(keys) > 5
    for key in [(), *keys]:
        path.write_text(yaml.safe_dump(without(whole, key), sort_keys=False))
        said = refusal(READERS[name], path)
        assert said.count("\n") == 0 < len(said), f"{'.'.join(map(str, key))}: {said}"


@pytest.mark.parametrize("file", ["home/site.yaml", "home/configurations.yaml"])
@pytest.mark.parametrize("version", ["-1", "0", "2"])
def test_other_versions_are_refused(file: str, version: str, folder: Path) -> None:
    path = folder / file
    key = "lios_site" if path.stem == "site" else "lios_configurations"
    path.write_text(path.read_text().replace(f"{key}: 1", f"{key}: {version}"))
    with pytest.raises(InputError, match=f"version {version}; this release reads 1"):
        READERS[file](path)


@pytest.mark.parametrize(
    ("house", "why"),
    [
        ("paper_home:", "or give paper_home"),
        ("home:", "or give home"),
        ("flat.yaml:", "needs no index"),
        ("flat.yaml:3", "needs no index"),
        ("houses:", "a whole number"),
        ("", "it is empty"),
    ],
)
def test_an_address_without_its_second_half(
    house: str, why: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert cli.run(["record", "--house", house, "--find", "mug", "-o", "run.mcap"]) == 2
    said = capsys.readouterr().err
    assert why in said
    assert len(said.splitlines()) == 1
    assert not Path("run.mcap").exists()


def refusal(reader: Callable[[Path], object], path: Path) -> str:
    """What a reader says of a file that it refuses; nothing of one that it reads."""
    try:
        reader(path)
    except InputError as error:
        return str(error)
    return ""


def sections(value: Any, above: tuple[Key, ...] = ()) -> Iterator[tuple[Key, ...]]:
    """The keys to each value of a mapping, and to the first of each list."""
    parts: list[tuple[Key, Any]] = list(value.items()) if isinstance(value, dict) else []
    if isinstance(value, list):
        parts = list(enumerate(value[:1]))
    for key, part in parts:
        yield (*above, key)
        yield from sections(part, (*above, key))


def without(value: Any, keys: tuple[Key, ...]) -> Any:
    """The value with nothing at these keys."""
    if not keys:
        return None
    if isinstance(value, list):
        return [without(part, keys[1:]) if i == keys[0] else part for i, part in enumerate(value)]
    return {key: without(part, keys[1:]) if key == keys[0] else part for key, part in value.items()}
