"""Filter expressions that select cells of a table, in the syntax of pytest's -k: "deliver and not greedy".

A word matches a cell if its name, "SCENARIO/STRATEGY", contains it, ignoring case. `not` binds closer than `and`,
`and` closer than `or`; parentheses group.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from workbench.errors import BadValue

MAX_TOKENS = 200
"""Most tokens of an expression; bounds the recursion of the parser."""

CellFilter = Callable[[str, str], bool]
"""(scenario, strategy) -> whether the cell is selected."""

_Test = Callable[[str], bool]
ALLOWED = 'words with and, or, not and parentheses, as "deliver and not greedy"'


def cell_filter(expression: str) -> CellFilter:
    """The filter of an expression; an empty one selects every cell.

    Raises:
        BadValue: an expression that cannot be read.
    """
    if not expression.strip():
        return lambda scenario, strategy: True
    reader = _Reader(expression)
    test = reader.either()
    reader.end()
    return lambda scenario, strategy: test(f"{scenario}/{strategy}".lower())


class _Reader:
    """A recursive-descent parser with one token of lookahead."""

    def __init__(self, expression: str) -> None:
        self.expression = expression
        tokens = re.findall(r"[()]|[^\s()]+", expression.lower())
        if len(tokens) > MAX_TOKENS:
            raise BadValue("-k", expression, f"at most {MAX_TOKENS} words")
        self.tokens: Iterator[str] = iter(tokens)
        self.token = next(self.tokens, "")

    def either(self) -> _Test:
        tests = [self.both()]
        while self.take("or"):
            tests.append(self.both())
        return lambda name: any(test(name) for test in tests)

    def both(self) -> _Test:
        tests = [self.one()]
        while self.take("and"):
            tests.append(self.one())
        return lambda name: all(test(name) for test in tests)

    def one(self) -> _Test:
        if self.take("not"):
            negated = self.one()
            return lambda name: not negated(name)
        if self.take("("):
            inner = self.either()
            if not self.take(")"):
                raise BadValue("-k", self.expression, ALLOWED)
            return inner
        word = self.token
        if word in ("", "and", "or", ")"):
            raise BadValue("-k", self.expression, ALLOWED)
        self.token = next(self.tokens, "")
        return lambda name: word in name

    def take(self, token: str) -> bool:
        if self.token != token:
            return False
        self.token = next(self.tokens, "")
        return True

    def end(self) -> None:
        if self.token:
            raise BadValue("-k", self.expression, ALLOWED)
