"""Reference pages made from the code when the site is built: commands, events of the log, tables, API.

Nothing here is written by hand, so that the pages cannot differ from what the program does.
"""

from __future__ import annotations

import inspect
import json
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import click
import msgspec
import pyarrow as pa
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from replayers.tables.schemas import SCHEMAS
from workbench import cli
from workbench.log_schema import events as vocabulary


def _changelog(path: Path) -> str:
    """CHANGELOG.md, whose links to pages start at the repository's root, as a page of the site."""
    return path.read_text(encoding="utf-8").replace("](docs/", "](")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds the generated pages."""
    pages = {
        "reference/commands.md": commands_page(),
        "reference/events.md": events_page(),
        "reference/tables.md": tables_page(),
        "reference/api.md": api_page(),
        "changelog.md": _changelog(Path(config.config_file_path).parent / "CHANGELOG.md"),
    }
    for path, content in pages.items():
        files.append(File.generated(config, path, content=content))
    return files


def commands_page() -> str:
    """One section a command, with its help as the terminal shows it."""
    lines = ["# Commands", "", "Made from the commands themselves. `lios COMMAND --help` prints the same.", ""]
    app = cli.app()
    for panel, names in cli.PANELS.items():
        lines += [f"## {panel}", ""]
        for name in names:
            lines += _command_lines(app, [name])
    return "\n".join(lines)


def _command_lines(app: click.Group, words: list[str]) -> list[str]:
    group: click.Command = app
    context = click.Context(app, info_name="lios")
    for word in words:
        found = group.get_command(context, word) if isinstance(group, click.Group) else None
        if found is None:
            return []
        group, context = found, click.Context(found, info_name=word, parent=context)
    if isinstance(group, cli.Commands):
        return [line for name in group.list_commands(context) for line in _command_lines(app, [*words, name])]
    text = group.get_help(context)
    return [f"### lios {' '.join(words)}", "", "```text", text.rstrip(), "```", ""]


def events_page() -> str:
    """One section a topic, with its fields and its JSON Schema."""
    lines = [
        "# Events of the log",
        "",
        f"Schema version {vocabulary.SCHEMA_VERSION}. Made from `workbench/log_schema/events.py`.",
        "",
    ]
    for topic, event in vocabulary.TOPICS.items():
        lines += [
            f"## `{topic}`: {vocabulary.schema_name(event)}",
            "",
            (inspect.getdoc(event) or "").replace("[", "\\["),
            "",
        ]
        lines += ["| field | type | default |", "|---|---|---|"]
        for field in msgspec.structs.fields(event):
            default = "required" if field.required else f"`{_default(field)}`"
            lines.append(f"| `{field.name}` | `{_type_name(field.type)}` | {default} |")
        schema = json.dumps(msgspec.json.schema(event), indent=2)
        lines += ["", '??? note "JSON Schema"', "", *("    " + line for line in _fenced(schema)), ""]
    return "\n".join(lines)


def tables_page() -> str:
    """One section a table of data frames, with its columns."""
    lines = [
        "# Tables of a log",
        "",
        "What `replayers.read(...).tables`, `replayers.read_many(...)` and `lios export` give. Made from "
        "`replayers/tables/schemas.py`. Units are metres, seconds and radians; costs are in metres of travel. "
        "Times are in UTC, with nanoseconds. Frames have a plain index from 0; `run_id` and `decision` join tables. "
        "A word is text that repeats: a categorical in pandas.",
        "",
    ]
    for name, schema in SCHEMAS.items():
        lines += [f"## `{name}`", "", "| column | type | what |", "|---|---|---|"]
        for field in schema:
            doc = (field.metadata or {}).get(b"doc", b"").decode()
            lines.append(f"| `{field.name}` | {_column_type(field.type)} | {doc} |")
        lines.append("")
    return "\n".join(lines)


def _column_type(kind: pa.DataType) -> str:
    if pa.types.is_dictionary(kind):
        return "word"
    if pa.types.is_list(kind):
        return "list of text"
    if pa.types.is_timestamp(kind):
        return "time"
    return {pa.string(): "text", pa.float64(): "number", pa.int64(): "whole number", pa.bool_(): "yes or no"}[kind]


def _fenced(text: str) -> list[str]:
    return ["```json", *text.splitlines(), "```"]


def _default(field: Any) -> str:
    if field.default is not msgspec.NODEFAULT:
        return repr(field.default)
    return repr(field.default_factory())


def _type_name(kind: Any) -> str:
    text = kind.__name__ if isinstance(kind, type) and not hasattr(kind, "__args__") else str(kind)
    return text.replace("workbench.log_schema.events.", "").replace("|", "\\|")


API = {
    "Data frames and runs": ("replayers", "replayers.runs.run", "replayers.tables.frames"),
    "Worlds": (
        "workbench.worlds.house",
        "workbench.worlds.world",
        "workbench.worlds.knowledge",
        "workbench.worlds.travel",
    ),
    "Beliefs": ("workbench.beliefs.belief", "workbench.beliefs.estimators"),
    "Search": (
        "workbench.search.engine",
        "workbench.search.find_costs",
        "workbench.search.policy",
        "workbench.search.policies.registry",
    ),
    "Planning": (
        "workbench.planning.tasks",
        "workbench.planning.plans",
        "workbench.planning.strategy",
        "workbench.planning.strategies",
    ),
    "Execution": ("workbench.execution.loop", "workbench.execution.events"),
    "Recording": ("recorders.run_recorder", "recorders.simulated_run"),
    "Counterfactuals": ("replayers.counterfactual.replay", "replayers.counterfactual.logged_world"),
    "Evaluation": (
        "workbench.evaluation.evaluations",
        "workbench.evaluation.beliefs.report",
        "workbench.evaluation.search.report",
        "workbench.evaluation.tasks.experiment",
    ),
    "Errors": ("workbench.errors",),
}


def api_page() -> str:
    """The modules that a user's own code imports."""
    lines = ["# Python API", "", "The modules that code of your own imports.", ""]
    for title, modules in API.items():
        lines += [f"## {title}", ""]
        for module in modules:
            lines += [f"::: {module}", ""]
    return "\n".join(lines)


def declared_commands() -> list[str]:
    """All commands by their words, for the test that every one has a section."""
    return sorted(entry.name.replace(".", " ") for entry in entry_points(group="lios.commands"))
