"""`lios new`: writes a template of a planner, policy or estimator with its test, or of a house or survey."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from workbench.options import Force
from workbench.parameters import Argument, Option

Name = Annotated[str, Argument(help="Its name: letters, digits and hyphens, such as rooms-first.")]
Folder = Annotated[Path, Option("--output", "-o", help="The folder to write to.")]


def planner(name: Name, output: Folder = Path(), force: Force = False) -> None:
    """Write a working planner and its test.

    Examples:

        lios new planner rooms-first && lios record --find mug --strategy rooms_first:RoomsFirst -o run.mcap
    """
    address = _written("planner", name, output, force=force)
    _tell(address, f"lios record --find mug --strategy {address} -o run.mcap", output)


def policy(name: Name, output: Folder = Path(), force: Force = False) -> None:
    """Write a working search policy and its test.

    Examples:

        lios new policy worth-first && lios evaluate search --queries 20 --policies worth_first:WorthFirst
    """
    address = _written("policy", name, output, force=force)
    _tell(address, f"lios evaluate search --queries 20 --no-figures --policies {address}", output)


def estimator(name: Name, output: Folder = Path(), force: Force = False) -> None:
    """Write a working estimator and its test.

    Examples:

        lios new estimator my-beliefs && lios record --find mug --estimator my_beliefs:MyBeliefs -o run.mcap
    """
    address = _written("estimator", name, output, force=force)
    _tell(address, f"lios record --find mug --estimator {address} -o run.mcap", output)


def house(
    name: Annotated[str, Argument(help="Its name: letters, digits and hyphens, such as my-flat.")],
    output: Folder = Path(),
    force: Force = False,
) -> None:
    """Write a house of two rooms as commented YAML, to adapt.

    Examples:

        lios new house my-flat && lios record --house my-flat.yaml --find mug -o run.mcap
    """
    file = output / f"{name}.yaml"
    _write_place("house.txt", name, file, force=force)
    _say_next(file, f"lios record --house {file} --find mug -o run.mcap")


def site(
    name: Annotated[str, Argument(help="Its name: letters, digits and hyphens, such as our-lab.")],
    output: Folder = Path(),
    force: Force = False,
) -> None:
    """Write the survey of a one-room real place, NAME/site.yaml, with comments, to adapt.

    Examples:

        lios new site our-lab && lios site check our-lab/site.yaml

        lios record --house our-lab/site.yaml --find mug -o run.mcap
    """
    file = output / name / "site.yaml"
    _write_place("site.txt", name, file, force=force)
    _say_next(file, f"lios site check {file}, and in simulation: lios record --house {file} --find mug -o run.mcap")


def _write_place(template: str, name: str, file: Path, *, force: bool) -> None:
    """Write the file of a house or a site from its template.

    Raises:
        BadValue: the name cannot be part of a file's.
        OutputExists: the file exists, and `force` is not given.
    """
    import re
    from string import Template

    from workbench.errors import BadValue, OutputExists
    from workbench.files import make_folder, write_text

    if not re.fullmatch(r"[A-Za-z0-9]+([-_][A-Za-z0-9]+)*", name):
        raise BadValue("NAME", name, "letters, digits and hyphens, such as my-flat")
    if file.exists() and not force:
        raise OutputExists(file)
    make_folder(file.parent)
    write_text(file, Template(_template(template)).substitute(module=name))


def _say_next(file: Path, command: str) -> None:
    from workbench.terminal import emit_text, say

    emit_text(str(file))
    say(f"Next: {command}")


def _written(kind: str, name: str, folder: Path, *, force: bool) -> str:
    """Write the module and its test from their templates; returns "module:Class"."""
    from string import Template

    from workbench.errors import OutputExists
    from workbench.files import make_folder, write_text
    from workbench.terminal import say

    words = _words(name)
    module, class_name = "_".join(words), "".join(word.capitalize() for word in words)
    values = {"module": module, "class_name": class_name, "plain_name": "-".join(words)}
    files = {f"{module}.py": f"{kind}.txt", f"test_{module}.py": f"{kind}_test.txt"}
    make_folder(folder)
    for file in files:
        if (folder / file).exists() and not force:
            raise OutputExists(folder / file)
    for file, template in files.items():
        text = Template(_template(template)).substitute(values)
        write_text(folder / file, text)
    say(f"Wrote {' and '.join(str(folder / file) for file in files)}.")
    return f"{module}:{class_name}"


def _words(name: str) -> tuple[str, ...]:
    """The words of a name.

    Raises:
        BadValue: no module could have this name, or another one that Python finds has it.
    """
    import keyword
    import re

    from workbench.errors import BadValue
    from workbench.plugins import installed_module

    words = tuple(word.lower() for word in re.split(r"[-_]", name))
    module = "_".join(words)
    if keyword.iskeyword(module):
        raise BadValue("NAME", name, f"another one: {module} is a keyword of Python")
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9]*([-_][A-Za-z0-9]+)*", name):
        raise BadValue("NAME", name, "letters, digits and hyphens, beginning with a letter, such as rooms-first")
    if installed_module(module) is not None:
        raise BadValue("NAME", name, f"another one: Python has a module {module} already")
    return words


def _template(name: str) -> str:
    folder = Path(__file__).resolve().parents[1] / "data" / "templates"
    return (folder / name).read_text(encoding="utf-8")


def _tell(address: str, command: str, folder: Path) -> None:
    from workbench.terminal import emit_text, say

    emit_text(address)
    where = "" if folder == Path() else f"cd {folder} && "
    module = address.partition(":")[0]
    say(f"Next: {where}{command}")
    say(f"Test: {where}python -m pytest test_{module}.py")
