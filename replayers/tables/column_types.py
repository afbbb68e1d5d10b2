"""Columns of a table before they become Arrow's or pandas' arrays: one class for each kind of column.

Most tables of a run have only a few rows, so the fixed cost of a column dominates. A vocabulary is checked by pandas
once, and shared by all columns that have it, in all logs: runs of one place have the same containers.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol, Self, final

import numpy as np

from replayers.tables.arrow import pa
from replayers.tables.schemas import NUMBER, TEXT, TIME, WHOLE, WORD, YES
from workbench.arrays import AnyArray, Bools, Ints32
from workbench.third_party.data_frames import pd

KEPT_WORDS = 256
"""Longer vocabularies are checked each time; 1,024 shorter ones are cached."""


class Column(Protocol):
    """The values of one column, one for each row."""

    def __len__(self) -> int: ...

    def to_arrow(self) -> pa.Array[Any]:
        """As an Arrow array of the type that replayers.tables.schemas declares."""
        ...

    def to_pandas(self) -> Any:
        """As an array that a data frame may own: missing values stay missing, integers stay integers, repeated text
        is categorical."""
        ...

    @classmethod
    def joined(cls, parts: Sequence[Any]) -> Self:
        """The rows of several columns of one class, concatenated."""
        ...


@final
@dataclass(frozen=True, slots=True)
class CategoryColumn:
    """Text that repeats: the number of its word, row by row; -1 where it is missing."""

    codes: Ints32
    words: tuple[str, ...]

    @classmethod
    def of(cls, values: Iterable[str | None]) -> CategoryColumn:
        known: dict[str, int] = {}
        codes = [-1 if value is None else known.setdefault(value, len(known)) for value in values]
        return cls(np.array(codes, dtype=np.int32), tuple(known))

    @classmethod
    def repeated(cls, words: Sequence[str], counts: Sequence[int]) -> CategoryColumn:
        """Every word, repeated as often as its count says."""
        each = cls.of(words)
        return cls(np.repeat(each.codes, counts), each.words)

    @classmethod
    def joined(cls, parts: Sequence[CategoryColumn]) -> CategoryColumn:
        known: dict[str, int] = {}
        codes: list[Ints32] = []
        for part in parts:
            numbers = [known.setdefault(word, len(known)) for word in part.words]
            codes.append(np.array([*numbers, -1], dtype=np.int32)[part.codes])
        return cls(np.concatenate(codes), tuple(known))

    def __len__(self) -> int:
        return len(self.codes)

    def to_arrow(self) -> pa.Array[Any]:
        codes = pa.array(self.codes, type=pa.int32(), mask=self.codes < 0)
        return pa.DictionaryArray.from_arrays(codes, pa.array(self.words, type=pa.string()))

    def to_pandas(self) -> pd.Categorical:
        kind = (_kept_category if len(self.words) <= KEPT_WORDS else _category)(self.words)
        return pd.Categorical.from_codes(self.codes, dtype=kind, validate=False)


@final
@dataclass(frozen=True, slots=True)
class NumberColumn:
    """Numbers, booleans or stamps of one Arrow type; `missing` is None where no row is missing."""

    values: AnyArray
    kind: pa.DataType
    missing: Bools | None = None

    @classmethod
    def of(cls, values: Sequence[Any], kind: pa.DataType) -> NumberColumn:
        """From Python numbers, None where missing.

        Raises:
            OverflowError: a number that does not fit into 64 bits.
        """
        missing = np.array([value is None for value in values], np.bool_) if None in values else None
        if missing is not None:
            instead = np.nan if kind == NUMBER else 0
            values = [instead if value is None else value for value in values]
        return cls(np.array(values, dtype=_NUMPY[kind]), kind, missing)

    @classmethod
    def joined(cls, parts: Sequence[NumberColumn]) -> NumberColumn:
        values = np.concatenate([part.values for part in parts])
        if all(part.missing is None for part in parts):
            return cls(values, parts[0].kind)
        missing = [np.zeros(len(part), np.bool_) if part.missing is None else part.missing for part in parts]
        return cls(values, parts[0].kind, np.concatenate(missing))

    def __len__(self) -> int:
        return len(self.values)

    def to_arrow(self) -> pa.Array[Any]:
        array = pa.array(self.values, mask=self.missing)
        return array.view(TIME) if self.kind == TIME else array

    def to_pandas(self) -> Any:
        if self.kind == NUMBER:
            return self.values
        if self.kind == TIME:
            return pd.DatetimeIndex(self.values.view("M8[ns]"), tz="UTC")
        missing = np.zeros(len(self.values), np.bool_) if self.missing is None else self.missing
        if self.kind == YES:
            return pd.arrays.BooleanArray(self.values, missing)
        return pd.arrays.IntegerArray(self.values, missing)


@final
@dataclass(frozen=True, slots=True)
class TextColumn:
    """Text that does not repeat, None where missing; or a list of words for each row."""

    values: list[Any]
    kind: pa.DataType

    @classmethod
    def joined(cls, parts: Sequence[TextColumn]) -> TextColumn:
        return cls([value for part in parts for value in part.values], parts[0].kind)

    def __len__(self) -> int:
        return len(self.values)

    def to_arrow(self) -> pa.Array[Any]:
        return pa.array(self.values, type=self.kind)

    def to_pandas(self) -> Any:
        if self.kind == TEXT:
            return _pandas_text(_TEXT, self.values)
        return self.to_arrow().to_numpy(zero_copy_only=False)


def column_of(values: Sequence[Any], kind: pa.DataType) -> Column:
    """A column of an Arrow type from Python values.

    Raises:
        OverflowError: a number that does not fit into 64 bits.
    """
    if kind == WORD:
        return CategoryColumn.of(values)
    return NumberColumn.of(values, kind) if kind in _NUMPY else TextColumn(list(values), kind)


def _category(words: tuple[str, ...]) -> pd.CategoricalDtype:
    return pd.CategoricalDtype(pd.Index(_pandas_text(_CATEGORY, words), copy=False))


def _pandas_text(kind: pd.StringDtype[Any], values: Sequence[str | None]) -> pd.api.extensions.ExtensionArray:
    """Text as pandas' own string array; pandas documents this constructor, but its stubs lack it."""
    return kind.__from_arrow__(pa.array(values, type=pa.large_string()))  # pyright: ignore[reportAttributeAccessIssue]


_kept_category = lru_cache(maxsize=1024)(_category)
_NUMPY: dict[pa.DataType, type[np.generic]] = {NUMBER: np.float64, WHOLE: np.int64, YES: np.bool_, TIME: np.int64}
_TEXT = pd.StringDtype("pyarrow")
_CATEGORY = pd.StringDtype(na_value=np.nan)
"""The categorical type that pandas makes of an index of words."""
