"""Turns columns into Arrow tables and pandas data frames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from replayers.tables.arrow import pa
from replayers.tables.column_types import Column, column_of
from replayers.tables.schemas import SCHEMAS
from workbench.third_party.data_frames import pd

try:
    from pandas.api.internals import (  # pyright: ignore[reportMissingImports] (not in the stubs)
        create_dataframe_from_blocks,
    )
except ImportError:
    create_dataframe_from_blocks = None

Columns = Mapping[str, Column]
"""By name, in the order of replayers.tables.schemas."""
_PLACES = [np.array([place]) for place in range(max(map(len, SCHEMAS.values())))]


def arrow_table(name: str, columns: Columns) -> pa.Table:
    """An Arrow table with its column descriptions as field metadata."""
    return pa.Table.from_arrays([column.to_arrow() for column in columns.values()], schema=SCHEMAS[name])


def data_frame(name: str, columns: Columns) -> pd.DataFrame:
    """The data frame that `Table.to_pandas` gives, but with types that keep missing values missing.

    `Table.to_pandas` starts threads and checks the categories of every column again: milliseconds for each table,
    more than it takes to read a small log. pandas 3 has a constructor that takes columns as they are, meant for
    libraries such as pyarrow; earlier versions have none.
    """
    rows = pd.RangeIndex(len(next(iter(columns.values()))))
    values = [column.to_pandas() for column in columns.values()]
    if create_dataframe_from_blocks is None:
        frame = pd.DataFrame(dict(enumerate(values)), index=rows, copy=False)
        frame.columns = _labels(name).view()
        return frame
    blocks = [(_block(value), _PLACES[i]) for i, value in enumerate(values)]
    return create_dataframe_from_blocks(blocks, rows, _labels(name).view())


def _block(values: Any) -> Any:
    """Columns of numpy arrays, and of stamps, are rows of a matrix inside pandas."""
    if isinstance(values, pd.DatetimeIndex):
        values = values.array
    elif not isinstance(values, np.ndarray):
        return values
    return values.reshape(1, -1)


def joined(name: str, parts: Sequence[Columns]) -> Columns:
    """The rows of several tables of one name, concatenated."""
    if not parts:
        return {field.name: column_of((), field.type) for field in SCHEMAS[name]}
    if len(parts) == 1:
        return parts[0]
    return {
        field.name: type(parts[0][field.name]).joined([part[field.name] for part in parts]) for field in SCHEMAS[name]
    }


@lru_cache(maxsize=64)
def _labels(name: str) -> pd.Index:
    """The column labels of a frame; each frame gets its own view, because users may set the labels' name."""
    return pd.Index(SCHEMAS[name].names)
