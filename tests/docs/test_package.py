"""Wheel and sdist build, contain all that is needed at run time, and work from outside the checkout."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest
from console_blocks import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PACKAGES = ("workbench", "recorders", "replayers", "dashboards")
NOT_CODE = {".py", ".pyc", ".nbi", ".nbc"}


def _data_files() -> list[str]:
    """What the packages hold beside Python, as paths from the checkout, by what git knows."""
    listed = subprocess.run(
        ["git", "ls-files", *PACKAGES], cwd=ROOT, capture_output=True, text=True, check=False
    ).stdout.splitlines()
    return [name for name in listed if Path(name).suffix not in NOT_CODE]


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a wheel and an sdist made from a copy of the sources."""
    pytest.importorskip("build", reason="needs the package build")
    source = tmp_path_factory.mktemp("source") / "lios"
    ignore = shutil.ignore_patterns("__pycache__", "*.egg-info", "*.nbi", "*.nbc")
    for name in PACKAGES:
        shutil.copytree(ROOT / name, source / name, ignore=ignore)
    for name in ("pyproject.toml", "README.md", "LICENSE", "CITATION.cff", "MANIFEST.in", "tools/check_claim.py"):
        (source / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, source / name)
    out = tmp_path_factory.mktemp("dist")
    made = subprocess.run(
        [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(out), str(source)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert made.returncode == 0, made.stdout + made.stderr
    return out


@pytest.mark.slow
def test_wheel_and_sdist_hold_all_data(built: Path) -> None:
    wanted = _data_files()
    assert any(name.endswith("houses.jsonl.gz") for name in wanted)
    (wheel,) = built.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        held = set(archive.namelist())
    assert [name for name in wanted if name not in held] == []
    assert [name for name in PACKAGES if f"{name}/py.typed" not in held] == []
    (sdist,) = built.glob("*.tar.gz")
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert [name for name in (*wanted, "tools/check_claim.py") if name not in names] == []


MINORS = (11, 12, 13, 14)
"""The versions of Python 3 that the package is for."""
MAX_DEFAULT_MB = 568
"""Of the default install, bytecode and pip included: 0.6 of what it once was; docs/install.md gives figures."""


def _python(minor: int) -> str:
    """A Python 3 of this minor version; without one, the test is skipped."""
    if sys.version_info[:2] == (3, minor):
        return sys.executable
    homes = [Path(p) for p in os.environ.get("PATH", "").split(os.pathsep)]
    homes += sorted(Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")).glob("versions/*/bin"))
    for home in homes:
        python = home / f"python3.{minor}"
        if python.exists() and "shims" not in python.parts:
            return str(python)
    pytest.skip(f"there is no Python 3.{minor} on PATH or in pyenv")


def _environment(python: str, folder: Path) -> Path:
    """An empty environment; returns its Python."""
    subprocess.run([python, "-m", "venv", str(folder)], check=True, capture_output=True)
    return folder / ("Scripts" if os.name == "nt" else "bin") / "python"


def _clean_environment() -> dict[str, str]:
    return {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "PIP", "VIRTUAL"))}


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_installed_it_runs_outside_the_checkout(built: Path, tmp_path: Path) -> None:
    """The wheel alone in an empty environment that borrows the dependencies of this one."""
    python = _environment(sys.executable, tmp_path / "venv")
    (wheel,) = built.glob("*.whl")
    install = [str(python), "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", str(wheel)]
    subprocess.run(install, check=True, env=_clean_environment(), capture_output=True)
    version = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    site = tmp_path / "venv" / "lib" / version / "site-packages"
    # A plain path: .pth files of the borrowed folder, which could lead back into the checkout, are not followed.
    (site / "borrowed.pth").write_text(sysconfig.get_paths()["purelib"] + "\n", encoding="utf-8")
    lios, outside = python.parent / "lios", tmp_path / "outside"
    outside.mkdir()
    where = _said(
        [python, "-c", "import workbench, dashboards; print(workbench.__file__, dashboards.__file__)"], outside
    )
    assert str(ROOT) not in where
    _does_its_job(lios, outside)


def _said(words: list[str | Path], folder: Path) -> str:
    """What a command that must succeed prints, in an environment without traces of this one."""
    done = subprocess.run(
        [str(word) for word in words],
        cwd=folder,
        env=_clean_environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def _does_its_job(lios: Path, folder: Path) -> None:
    assert PROJECT["version"] in _said([lios, "--version"], folder)
    assert '"status": "done"' in _said([lios, "demo", "--no-view", "--json"], folder)
    assert "9 containers" in _said([lios, "site", "check", "paper_home"], folder)
    assert "complete" in _said([lios, "--completion", "bash"], folder)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("minor", MINORS)
def test_it_works_with_its_dependencies_in_an_empty_environment(minor: int, built: Path, tmp_path: Path) -> None:
    """With the versions that were tested together; nothing is borrowed."""
    own = _environment(_python(minor), tmp_path / "venv")
    (wheel,) = built.glob("*.whl")
    constraint = str(ROOT / "constraints.txt")
    registry = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL"))}
    _install([str(own), "-m", "pip", "install", "--quiet", "--constraint", constraint, str(wheel)], registry)
    outside = tmp_path / "outside"
    outside.mkdir()
    assert _said([own, "-m", "pip", "check"], outside)
    assert int(_said(["du", "-sm", own.parents[1]], outside).split()[0]) < MAX_DEFAULT_MB
    _does_its_job(own.parent / "lios", outside)


def _install(words: list[str], env: dict[str, str]) -> None:
    made = subprocess.run(words, env=env, capture_output=True, text=True, check=False)
    if made.returncode and re.search(r"name resolution|[Cc]onnection|unreachable|timed out", made.stderr):
        pytest.skip("no package registry can be reached")
    assert made.returncode == 0, made.stderr


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_it_works_with_the_lowest_versions_that_it_allows(built: Path, tmp_path: Path) -> None:
    """On the lowest Python, with the lowest version of each dependency that pyproject.toml names."""
    uv = _uv()
    own = _environment(_python(MINORS[0]), tmp_path / "venv")
    (wheel,) = built.glob("*.whl")
    registry = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL"))}
    # For uv, what a wheel needs is not direct: it takes the lowest of what it is given itself.
    resolve = [*uv, "pip", "install", "--quiet", "--python", str(own), "--resolution", "lowest-direct"]
    tables = PROJECT["optional-dependencies"]["tables"]
    _install([*resolve, f"{wheel}[tables]", *PROJECT["dependencies"], *tables], registry)
    lowest = dict(r.split(">=") for r in (*PROJECT["dependencies"], *tables))
    outside = tmp_path / "outside"
    outside.mkdir()
    assert _said([own, "-c", "import pandas; print(pandas.__version__)"], outside).startswith(lowest["pandas"])
    lios = own.parent / "lios"
    _does_its_job(lios, outside)
    _said([lios, "record", "--find", "mug", "-o", "run.mcap"], outside)
    _said([lios, "export", "run.mcap", "-o", "tables"], outside)
    _said([lios, "figures", "run.mcap", "-o", "figures"], outside)
    _said([lios, "capsule", "run.mcap", "-o", "run.html"], outside)


def _uv() -> list[str]:
    if find_spec("uv") is not None:
        return [sys.executable, "-m", "uv"]
    if (found := shutil.which("uv")) is None:
        pytest.skip("there is no uv")
    return [found]


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("minor", MINORS)
def test_its_metadata_and_syntax_suit(minor: int, built: Path, tmp_path: Path) -> None:
    """Installs without dependencies, compiles everything, and prints the version."""
    own = _environment(_python(minor), tmp_path / "venv")
    (wheel,) = built.glob("*.whl")
    plain = _clean_environment()
    install = [str(own), "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--no-compile", str(wheel)]
    subprocess.run(install, check=True, env=plain, capture_output=True)
    site = next((tmp_path / "venv" / "lib").glob("python*")) / "site-packages"
    done = subprocess.run(
        [str(own), "-W", "error", "-m", "compileall", "-q", *(str(site / name) for name in PACKAGES)],
        env=plain,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    version = "from importlib.metadata import version, entry_points as e; print(version('lios-workbench'))"
    assert subprocess.run([str(own), "-c", version], env=plain, check=True, capture_output=True).stdout
