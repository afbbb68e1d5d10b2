"""`lios strategies`, `policies`, `estimators`, `scenarios` and `solvers`: the names that options take."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import click

from workbench.options import Json


def _lister(kind: str, options: str, own: str) -> Callable[[Json], None]:
    """The command that lists one kind of names; `own`: how the user's own are named."""

    def command(json: Json = False) -> None:
        _list(kind, own, json=json)

    command.__name__ = command.__qualname__ = kind
    noun = "search policies" if kind == "policies" else kind
    command.__doc__ = f"List the {noun}: what {options}.\n\nExamples:\n\n    lios {kind}\n"
    return command


strategies = _lister(
    "strategies",
    "--strategy and --strategies take",
    'Yours: module:Class (see "lios new planner"); with a solver: NAME@SOLVER.',
)
policies = _lister("policies", "--policies takes", 'Yours: module:function or module:Class (see "lios new policy").')
estimators = _lister(
    "estimators",
    "--estimator takes",
    'Yours: module:Class (see "lios new estimator"), a .safetensors of lios train, or a .prompt.',
)
scenarios = _lister(
    "scenarios", "--scenario and --scenarios take", "Yours: a task file, lios record --task FILE.yaml."
)
solvers = _lister(
    "solvers",
    "--solver and STRATEGY@SOLVER take",
    'Others: up-ENGINE of unified-planning, "command:LINE {domain} {problem}", module:Class.',
)


def _list(kind: str, own: str, *, json: bool) -> None:
    from workbench.registered_names import left_out_names, registered_names
    from workbench.terminal import emit_json, emit_table, say

    defaults = _defaults(kind)
    rows = [
        {
            "name": known.name,
            "default of": ", ".join(defaults.get(known.name, ())) or None,
            "what": known.line if known.source == "built in" else f"{known.line} of {known.source}",
        }
        for known in registered_names(kind)
    ]
    if json:
        answer = [
            {"name": k.name, "line": k.line, "source": k.source, "default_of": list(defaults.get(k.name, ()))}
            for k in registered_names(kind)
        ]
        emit_json({"rows": answer, "left_out": left_out_names(kind)})
        return
    shown = (
        rows if any(row["default of"] for row in rows) else [{k: row[k] for k in ("name", "what")} for row in rows]
    )
    emit_table(shown)
    say(own)
    for line in left_out_names(kind):
        say(f"note: {line}")


def _defaults(kind: str) -> dict[str, tuple[str, ...]]:
    """For each name, the commands of which it is the default value of an option that takes this kind."""
    from workbench.cli import app
    from workbench.registered_names import KIND_OF_OPTION

    found: dict[str, list[str]] = {}
    for words, command in _commands(app(), ()):
        for param in command.params:
            if not isinstance(param.default, str) or not any(KIND_OF_OPTION.get(o) == kind for o in param.opts):
                continue
            for name in param.default.split(","):
                found.setdefault(name.strip(), []).append(" ".join(words))
    return {name: tuple(dict.fromkeys(commands)) for name, commands in found.items()}


def _commands(group: click.Group, words: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if isinstance(command, click.Group):
            yield from _commands(command, (*words, name))
        elif command is not None:
            yield (*words, name), command
