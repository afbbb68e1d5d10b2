"""The direction of imports, single points of access (one module writes MCAP, one reads it, one package imports
torch), and the sizes and names of files, functions and folders.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from product_source import ROOT, files, parsed, statements


def _importers(pattern: str) -> list[str]:
    """Files in which a line imports what the pattern names."""
    line = re.compile(rf"^\s*(from|import)\s+({pattern})\b", re.MULTILINE)
    return [str(path.relative_to(ROOT)) for path in files() if line.search(path.read_text(encoding="utf-8"))]


def test_imports_point_one_way() -> None:
    """In a process of its own, because import-linter switches off the loggers of the one in which it runs."""
    code = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports(no_cache=True))"
    ran = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr


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
    assert [p.name for p in files() if forbidden.search(p.read_text(encoding="utf-8"))] == []


def test_array_types_stand_in_one_module() -> None:
    written = [
        path.relative_to(ROOT).as_posix() for path in files() if "NDArray[" in path.read_text(encoding="utf-8")
    ]
    assert written == ["workbench/arrays.py"]


def test_one_class_has_one_name() -> None:
    named = Counter(
        node.name
        for path in files()
        for node in parsed(path).body
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    assert {name for name, count in named.items() if count > 1} == SEVERAL_CLASSES


def test_nothing_holds_merge_marks() -> None:
    """A docstring may hold them and still pass every other check."""
    written = [*files(), *(ROOT / "docs").rglob("*.md"), ROOT / "README.md", *(ROOT / "tests").rglob("*.py")]
    marks = re.compile(r"^\s*(<{7}|>{7}) ", re.M)
    assert [p.name for p in written if marks.search(p.read_text(encoding="utf-8"))] == []


MAX_FILE_LINES, MAX_FUNCTION_LINES, MAX_PARAMETERS, MAX_FOLDER_MODULES = 400, 60, 8, 17

LONG_FUNCTIONS = {
    "workbench/planning/builtin/astar.py search_states": "arrays in one function; handed on, 1.13 of the time",
    "tests/benchmarks/test_scene_speed.py _run": "a run of 10,000 events written out, one kind after another",
}

MANY_PARAMETERS = {
    "recorders/record_run.py record": "the options of `lios record`, all by keyword",
    "recorders/run_recorder.py RunRecorder": "what one log consists of, all by keyword; its docstring says more",
    "workbench/planning/builtin/errand_moves.py moves_from": "arrays in named tuples took 1.13 to 1.4 of the time",
    "workbench/planning/builtin/lower_bounds.py heuristic": "as moves_from",
    "workbench/planning/builtin/astar.py search_states": "as moves_from",
    "workbench/planning/builtin/delivery_orders.py cheapest_delivery": "as moves_from",
}

SEVERAL_CLASSES = {"Commands", "FindCosts", "SeenInPassing", "State"}
"""Names that two classes may have: one of each is of the log's wire format or a service of the simulated robot."""

CROSS_CUTTING_TESTS = {
    "test_architecture": "all packages",
    "test_frozen_values": "every frozen class",
    "test_stopped_early": "every command that prints",
    "test_abandoned_drafts": "every writer of drafts",
    "test_bad_output_places": "every command with an output",
    "test_all_layouts": "every reader of logs",
    "test_import_evidence": "importing, as far as replays",
}
"""Tests of no one module; those of documents and of the package as shipped stand in tests/docs."""


def _tests() -> list[Path]:
    return sorted((ROOT / "tests").rglob("*.py"))


def _name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


Function = ast.FunctionDef | ast.AsyncFunctionDef


def _functions(tree: ast.Module) -> Iterator[tuple[str, Function]]:
    """Every function with its name, that of a constructor being its class."""
    owner = {
        id(part): node.name
        for node in statements(tree)
        if isinstance(node, ast.ClassDef)
        for part in node.body
        if isinstance(part, Function) and part.name == "__init__"
    }
    for node in statements(tree):
        if isinstance(node, Function):
            yield owner.get(id(node), node.name), node


def _is_command(path: Path, node: Function) -> bool:
    """Whether a function declares a command: its parameters are options and arguments with their help."""
    words = [ast.unparse(a.annotation) for a in (*node.args.args, *node.args.kwonlyargs) if a.annotation]
    declared = any(re.search(r"\b(Option|Argument)\(", word) for word in words)
    return "commands" in path.parts and declared


def test_no_file_is_long() -> None:
    scripts = sorted(path for path in (ROOT / "dashboards").rglob("*.js") if not path.name.endswith(".min.js"))
    assert scripts
    texts = [*files(), *_tests(), *scripts]
    long = {_name(path): len(path.read_text(encoding="utf-8").splitlines()) for path in texts}
    assert {name: lines for name, lines in long.items() if lines > MAX_FILE_LINES} == {}


def test_no_function_is_long_but_declarations_of_commands() -> None:
    long = {
        f"{_name(path)} {name}"
        for path in (*files(), *_tests())
        for name, node in _functions(parsed(path))
        if (node.end_lineno or 0) - node.lineno + 1 > MAX_FUNCTION_LINES and not _is_command(path, node)
    }
    assert long == set(LONG_FUNCTIONS)


def test_public_functions_have_few_parameters() -> None:
    many = {
        f"{_name(path)} {name}"
        for path in files()
        for name, node in _functions(parsed(path))
        if not name.startswith("_") and not _is_command(path, node) and len(_parameters(node)) > MAX_PARAMETERS
    }
    assert many == set(MANY_PARAMETERS)


def _parameters(node: Function) -> list[str]:
    given = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
    return [a.arg for a in given if a.arg not in ("self", "cls")]


def test_modules_say_what_is_in_them() -> None:
    wrong: list[str] = []
    for path in (*files(), *_tests()):
        first = (ast.get_docstring(parsed(path)) or "").split("\n\n")[0]
        sentence = re.split(r"(?<=[.?!])\s", first)[0]
        if sentence.endswith("?") or (not first and path.stem != "__init__"):
            wrong.append(_name(path))
    assert wrong == []


def test_no_folder_is_crowded() -> None:
    modules = Counter(_name(path.parent) for path in files() if path.stem != "__init__")
    assert {folder: n for folder, n in modules.items() if n > MAX_FOLDER_MODULES} == {}


def test_tests_bear_the_names_of_modules() -> None:
    known = {path.parent.name if path.stem == "__init__" else path.stem for path in files()}
    known |= {path.parent.name for path in files()}
    nameless = set[str]()
    for path in _tests():
        words = path.stem.split("_")[1:]
        mirrors = any("_".join(words[:n]) in known for n in range(1, len(words) + 1))
        if path.stem.startswith("test_") and path.parent.name != "docs" and not mirrors:
            nameless.add(path.stem)
    assert nameless == set(CROSS_CUTTING_TESTS)
    names = Counter(path.stem for path in _tests() if path.stem.startswith("test_"))
    assert [name for name, n in names.items() if n > 1] == []
