"""The priority queue and the hash table of states of the recipe search, compiled with numba."""

# pyright: reportMissingParameterType=false, reportUnknownParameterType=false, reportUnknownLambdaType=false

from __future__ import annotations

from typing import Any

import numpy as np

from workbench.third_party.kernels import kernel

INF = np.inf


def compiled(function: Any) -> Any:
    """The function compiled by numba, kept on disk; it releases the GIL."""
    return kernel()(function)


@compiled
def row_of_code(code, table, size):
    """The row of a code in the hash table, or the free row for it."""
    h = code * np.int64(-7046029254386353131)
    i = ((h >> 20) ^ h) & (size - 1)
    while table[i, 0] != -1 and table[i, 0] != code:
        i = (i + 1) & (size - 1)
    return i


@compiled
def grown_table(table):
    """The hash table with twice as many rows."""
    size = table.shape[0] * 2
    bigger = np.full((size, 2), -1, dtype=np.int64)
    for i in range(table.shape[0]):
        if table[i, 0] != -1:
            j = row_of_code(table[i, 0], bigger, size)
            bigger[j, 0] = table[i, 0]
            bigger[j, 1] = table[i, 1]
    return bigger


@compiled
def _before(f, n, other_f, other_n, eps):
    """Whether a state is looked at before another: it costs less, or the same (ties.py) and is younger."""
    return f < other_f - eps or (f <= other_f + eps and n > other_n)


@compiled
def push(heap_f, heap_n, count, f, n, eps):
    """Add node n of estimated cost f to a heap of so many entries."""
    i = count
    while i > 0:
        p = (i - 1) >> 1
        if _before(heap_f[p], heap_n[p], f, n, eps):
            break
        heap_f[i] = heap_f[p]
        heap_n[i] = heap_n[p]
        i = p
    heap_f[i] = f
    heap_n[i] = n


@compiled
def pop(heap_f, heap_n, count, eps):
    """Remove the top of the heap; the caller has read it and decrements the count."""
    last = count - 1
    f = heap_f[last]
    n = heap_n[last]
    i = 0
    while True:
        k = 2 * i + 1
        if k >= last:
            break
        if k + 1 < last and _before(heap_f[k + 1], heap_n[k + 1], heap_f[k], heap_n[k], eps):
            k += 1
        if _before(f, n, heap_f[k], heap_n[k], eps):
            break
        heap_f[i] = heap_f[k]
        heap_n[i] = heap_n[k]
        i = k
    heap_f[i] = f
    heap_n[i] = n
