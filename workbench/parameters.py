"""Command-line parameters as annotations of a function: `Option`, `Argument`, and the click command made of them.

A command is a plain function, which tests and scripts call as any other. The type and the default of a parameter
stand in its signature; its annotation says how the command line spells and explains it.

    def looks(log: Annotated[Path, Argument(help="A log.")], most: Annotated[int, Option("--most", min=1)] = 10): ...

Options that several commands have in common may be the fields of one dataclass, which is then the parameter's type.
"""

from __future__ import annotations

import inspect
import math
import types
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

import click
from click.shell_completion import CompletionItem

from workbench.errors import BadValue
from workbench.registered_names import KIND_OF_OPTION, completions
from workbench.remote.errors import LocalFileRequired
from workbench.remote.path import RemotePath, path_of


@dataclass(frozen=True, slots=True, init=False)
class Option:
    """An option of a command.

    Args:
        spellings: as they are typed: "-o", "--output"; "--figures/--no-figures" for a switch of two ways. Without
            any it is the parameter's name, and a switch has both ways.
        help: the sentence in the command's help.
        min, max: the range of a number, ends included.
        file: the file that a path means, where some names stand for files elsewhere.
    """

    spellings: tuple[str, ...]
    help: str
    min: float | None
    max: float | None
    file: Callable[[Path], Path] | None

    def __init__(
        self,
        *spellings: str,
        help: str = "",
        min: float | None = None,
        max: float | None = None,
        file: Callable[[Path], Path] | None = None,
    ) -> None:
        for name, value in (("spellings", spellings), ("help", help), ("min", min), ("max", max), ("file", file)):
            object.__setattr__(self, name, value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Argument:
    """An argument of a command: what stands on the line without a name before it.

    Args:
        help: the sentence in the command's help.
        local: a path must be of this machine, because the command writes to it or needs all of it; otherwise an
            address, such as s3://bucket/run.mcap, is one too.
    """

    help: str = ""
    local: bool = False


def command_of(name: str, function: Callable[..., Any], *, help: str) -> click.Command:
    """The click command that calls a function with what the line gives for its parameters.

    Parameters may be bool (options only), int, float, str and Path; each of them or None; and lists of the last four,
    which may be given several times. A dataclass stands for an option for each of its fields. Numbers are finite,
    whole ones within 64 bits; a parameter called seed is not negative.

    Raises:
        TypeError: a parameter without Option or Argument, or of another type.
    """
    hints = get_type_hints(function, include_extras=True)
    groups = {name: hint for name, hint in hints.items() if is_dataclass(hint) and isinstance(hint, type)}
    given: list[tuple[inspect.Parameter, Any]] = []
    for parameter in inspect.signature(function).parameters.values():
        group = groups.get(parameter.name)
        given += [(parameter, hints.get(parameter.name))] if group is None else _fields(group)
    params = [_parameter(parameter, hint) for parameter, hint in given]
    several = {
        parameter.name: parameter.default
        for param, (parameter, _) in zip(params, given, strict=True)
        if param.multiple or param.nargs == -1
    }

    def call(**values: Any) -> Any:
        # click gives a tuple for what may be given several times, an empty one where it was not given.
        values |= {name: list(values[name]) if values[name] else default for name, default in several.items()}
        for name, group in groups.items():
            values[name] = group(**{field.name: values.pop(field.name) for field, _ in _fields(group)})
        return function(**values)

    return _Explained(name, callback=call, params=params, help=help)


def require_left_out(
    function: Callable[..., Any], given: Mapping[str, Any], *, but: Sequence[str], where: str
) -> None:
    """Refuses options that would have no effect, so that nobody takes them to have had one.

    Args:
        function: the command's function.
        given: its parameters by name, as they were given.
        but: the parameters that have an effect.
        where: in which case the others have none, for the error.

    Raises:
        BadValue: another parameter differs from its default.
    """
    hints = get_type_hints(function, include_extras=True)
    for name, parameter in inspect.signature(function).parameters.items():
        if name not in but and given[name] != parameter.default:
            how = next(each for each in get_args(hints[name]) if isinstance(each, Option))
            option = max((spelling for spelling in how.spellings or (f"--{name}",)), key=len)
            value = given[name]
            shown = "on" if value is True else ", ".join(map(str, value)) if isinstance(value, list) else str(value)
            raise BadValue(option, shown, f"left out {where}")


def _fields(group: type) -> list[tuple[inspect.Parameter, Any]]:
    """The fields of a group of options as parameters, with their annotations."""
    hints = get_type_hints(group, include_extras=True)
    return [(field, hints.get(field.name)) for field in inspect.signature(group).parameters.values()]


def _parameter(given: inspect.Parameter, hint: Any) -> click.Parameter:
    metadata = get_args(hint)[1:] if get_origin(hint) is Annotated else ()
    how = next((each for each in metadata if isinstance(each, Option | Argument)), None)
    if how is None:
        raise TypeError(f"parameter {given.name!r} has no Option or Argument of workbench.parameters")
    kind, several = _kind(get_args(hint)[0])
    attributes: dict[str, Any] = {"required": given.default is inspect.Parameter.empty}
    if not attributes["required"] and not several:
        attributes["default"] = given.default
    if isinstance(how, Argument):
        path = _LocalPath() if how.local else _PathOrAddress()
        value = path if kind is Path else _type(given.name, kind, None, None)
        attributes |= {"type": value, "nargs": -1 if several else 1}
        note = "[required]" if attributes["required"] else f"[default: {given.default}]" if given.default else ""
        return _ExplainedArgument([given.name], f"{how.help}  {note}".strip(), **attributes)
    if kind is bool:
        attributes["is_flag"] = True
    else:
        value = _type(given.name, kind, how.min, how.max) if how.file is None else _LocalPath(how.file)
        attributes |= {"type": value, "multiple": several}
    plain = given.name.replace("_", "-")
    spellings = how.spellings or (f"--{plain}/--no-{plain}" if kind is bool else f"--{plain}",)
    if kind is str and not KIND_OF_OPTION.keys().isdisjoint(spellings):
        attributes["shell_complete"] = _complete_name
    return click.Option([given.name, *spellings], help=how.help, show_default=given.default != "", **attributes)


def _complete_name(_: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    return [CompletionItem(value) for value in completions(tuple(param.opts), incomplete)]


def _kind(hint: Any) -> tuple[type, bool]:
    """The type of one value, and whether there may be several."""
    if get_origin(hint) in (Union, types.UnionType):
        hint = next(part for part in get_args(hint) if part is not type(None))
    return (get_args(hint)[0], True) if get_origin(hint) is list else (hint, False)


def _type(name: str, kind: type, low: float | None, high: float | None) -> click.ParamType[Any]:
    """The type of a parameter; nan and inf are refused, and for a seed also negative numbers."""
    if kind is float:
        return _Finite() if low is None and high is None else _FiniteRange(low, high)
    if kind is int:
        low = 0 if name == "seed" else low
        return _Whole() if low is None and high is None else _WholeRange(_whole(low), _whole(high))
    if kind is str:
        return click.STRING
    if kind is Path:
        return _LocalPath()
    raise TypeError(f"parameter {name!r}: no command line gives a {kind}")


def _whole(end: float | None) -> int | None:
    return None if end is None else int(end)


class _PathOrAddress(click.Path):
    """A path, or an address, whose two slashes it keeps."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return path_of(value) if isinstance(value, str) else value


class _LocalPath(click.Path):
    """A path of this machine."""

    def __init__(self, file: Callable[[Path], Path] | None = None) -> None:
        super().__init__(path_type=Path)
        self.file = file

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        path = path_of(value) if isinstance(value, str) else value
        if isinstance(path, RemotePath):
            raise LocalFileRequired("path" if param is None else _named(param), path)
        return path if self.file is None or path is None else self.file(path)


def _named(param: click.Parameter) -> str:
    return "/".join(sorted(param.opts, key=len)) if isinstance(param, click.Option) else str(param.name).upper()


class _Finite(click.types.FloatParamType):
    """A finite number: nan would pass every comparison, and so every range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        return _finite(super().convert(value, param, ctx), param, ctx)


class _FiniteRange(click.FloatRange):
    """The same within a range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        return _finite(super().convert(value, param, ctx), param, ctx)


def _finite(number: float, param: click.Parameter | None, ctx: click.Context | None) -> float:
    if not math.isfinite(number):
        raise click.BadParameter(f"{number} is not a finite number.", ctx, param)
    return number


class _Whole(click.types.IntParamType):
    """A whole number that a log, a table and an array can hold."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        return _of_64_bits(super().convert(value, param, ctx), param, ctx)


class _WholeRange(click.IntRange):
    """The same within a range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        return _of_64_bits(super().convert(value, param, ctx), param, ctx)


def _of_64_bits(number: int, param: click.Parameter | None, ctx: click.Context | None) -> int:
    if not -(1 << 63) <= number < 1 << 63:
        raise click.BadParameter(
            f"{number} is beyond 64 bits: give one of at least -2^63 and below 2^63.", ctx, param
        )
    return number


class GivenTwice(click.BadOptionUsage):
    """An option that takes one value was given several."""

    def __init__(self, option: click.Option, ctx: click.Context) -> None:
        name = max(option.opts, key=len)
        several = "commas" in (option.help or "") or "comma-separated" in (option.help or "")
        how = "one value; give several names in it, with commas between them" if several else "one value"
        super().__init__(name, f"{name} is given twice. It takes {how}.", ctx)


class GivenEmpty(click.BadParameter):
    """An option or an argument was given an empty text."""

    def __init__(self, param: click.Parameter, ctx: click.Context) -> None:
        kind = "option" if isinstance(param, click.Option) else "argument"
        super().__init__(f"it is empty. Give a value, or omit the {kind}.", ctx, param)


def _has_empty_text(value: object) -> bool:
    """Whether a value as typed, or one of several, is a text of no characters."""
    values: Sequence[object] = value if isinstance(value, list | tuple) else (value,)
    return any(isinstance(one, str) and not one.strip() for one in values)


class _ExplainedArgument(click.Argument):
    """An argument with a sentence of help, also where click has none for arguments (before 8.5)."""

    def __init__(self, names: Sequence[str], sentence: str, **attributes: Any) -> None:
        super().__init__(names, **attributes)
        self.sentence = sentence

    def explained(self, ctx: click.Context) -> tuple[str, str]:
        return self.make_metavar(ctx), self.sentence


class _Explained(click.Command):
    """A command whose help lists its arguments before its options, and that refuses repeated and empty values."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """As click, which otherwise silently keeps the last of several values of an option that takes one.

        An empty text, as of a shell variable that is not set, would mean the default, or as a path this folder.
        """
        if not ctx.resilient_parsing:
            given, _, order = self.make_parser(ctx).parse_args(args=list(args))
            for param, count in Counter(order).items():
                if count > 1 and isinstance(param, click.Option) and not (param.multiple or param.is_flag):
                    raise GivenTwice(param, ctx)
                if _has_empty_text(given.get(str(param.name))):
                    raise GivenEmpty(param, ctx)
        return super().parse_args(ctx, args)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        params = self.get_params(ctx)
        arguments = [param.explained(ctx) for param in params if isinstance(param, _ExplainedArgument)]
        options = [param.get_help_record(ctx) for param in params if isinstance(param, click.Option)]
        for title, rows in (("Arguments", arguments), ("Options", [row for row in options if row is not None])):
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)
