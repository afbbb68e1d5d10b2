"""How do columns become a table of Arrow's, or a data frame of pandas'?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa

from replayers.cells import Column, column_of
from replayers.columns import SCHEMAS

try:
    from pandas.api.internals import (  # pyright: ignore[reportMissingImports] (not in the stubs)
        create_dataframe_from_blocks,
    )
except ImportError:
    create_dataframe_from_blocks = None

Columns = Mapping[str, Column]
"""By name, in the order of replayers.columns."""
_PLACES = [np.array([place]) for place in range(max(map(len, SCHEMAS.values())))]


def arrow_table(name: str, columns: Columns) -> pa.Table:
    """A table with its descriptions."""
    return pa.Table.from_arrays([column.to_arrow() for column in columns.values()], schema=SCHEMAS[name])


def data_frame(name: str, columns: Columns) -> pd.DataFrame:
    """A table as the frame that `Table.to_pandas` gives, with types that keep missing values as what they are.

    `Table.to_pandas` starts threads and checks the categories of every column anew: milliseconds a table, which is
    more than reading a small log takes. The constructor that takes columns as they are is the one that pandas keeps
    for libraries such as pyarrow; before pandas 3 there is none.
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
    """Columns of numpy's, and of stamps, are rows of a matrix inside pandas."""
    if isinstance(values, pd.DatetimeIndex):
        values = values.array
    elif not isinstance(values, np.ndarray):
        return values
    return values.reshape(1, -1)


def joined(name: str, parts: Sequence[Columns]) -> Columns:
    """The rows of several tables of one name below each other."""
    if not parts:
        return {field.name: column_of((), field.type) for field in SCHEMAS[name]}
    if len(parts) == 1:
        return parts[0]
    return {
        field.name: type(parts[0][field.name]).joined([part[field.name] for part in parts]) for field in SCHEMAS[name]
    }


@cache
def _labels(name: str) -> pd.Index:
    """What a frame's columns are called; a frame gets a view, because labels have a name that users may set."""
    return pd.Index(SCHEMAS[name].names)
