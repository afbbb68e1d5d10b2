"""How does an Arrow table become a data frame? Column by column, because most tables of a run have a few rows.

`Table.to_pandas` starts threads and checks the categories of every column anew: milliseconds a table, which is more
than reading a small log takes. Here a vocabulary is checked once and shared by the columns that have it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

Vocabularies = dict[tuple[str, ...], pd.CategoricalDtype]
"""Categories that were checked already; they never change, so columns and tables share them."""


def data_frame(table: pa.Table, vocabularies: Vocabularies) -> pd.DataFrame:
    """The frame that `table.to_pandas` gives, with types that keep missing values as what they are.

    Whole numbers are Int64, yes/no is boolean, text is pandas' own text, repeated text is categorical.
    """
    columns = {
        name: _column(_one_piece(column), vocabularies)
        for name, column in zip(table.column_names, table.columns, strict=True)
    }
    return pd.DataFrame(columns, index=pd.RangeIndex(table.num_rows), copy=False)


def _one_piece(column: pa.ChunkedArray) -> pa.Array:
    return column.chunk(0) if column.num_chunks == 1 else column.combine_chunks()


def _column(array: pa.Array, vocabularies: Vocabularies) -> Any:
    kind = array.type
    if pa.types.is_dictionary(kind):
        return _words(array, vocabularies)
    if pa.types.is_timestamp(kind):
        return pd.DatetimeIndex(_filled(array.view(pa.int64()), pd.NaT.value).view("M8[ns]"), tz="UTC")
    if kind == pa.string():
        return _TEXT.__from_arrow__(array)
    if kind == pa.int64():
        return pd.arrays.IntegerArray(*_with_mask(array, 0))
    if kind == pa.bool_():
        return pd.arrays.BooleanArray(*_with_mask(array, False))
    return array.to_numpy(zero_copy_only=False, writable=True)


def _words(array: pa.DictionaryArray, vocabularies: Vocabularies) -> pd.Categorical:
    words = tuple(array.dictionary.to_pylist())
    kind = vocabularies.get(words)
    if kind is None:
        text = _CATEGORY.__from_arrow__(array.dictionary)
        kind = vocabularies[words] = pd.CategoricalDtype(pd.Index(text, copy=False))
    return pd.Categorical.from_codes(_filled(array.indices, -1), dtype=kind, validate=False)


def _with_mask(array: pa.Array, instead: Any) -> tuple[Any, Any]:
    """Values as numpy has them, and where they are missing."""
    missing = array.is_null().to_numpy(zero_copy_only=False) if array.null_count else np.zeros(len(array), np.bool_)
    return _filled(array, instead), missing


def _filled(array: pa.Array, instead: Any) -> Any:
    full = array.fill_null(instead) if array.null_count else array
    return full.to_numpy(zero_copy_only=False, writable=True)


_TEXT = pd.StringDtype("pyarrow")
_CATEGORY = pd.StringDtype(na_value=np.nan)
"""What pandas makes of an index of words."""
