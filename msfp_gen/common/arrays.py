"""The array types of the package, ndarrays of any shape; and arrays that lie one after the other in one."""

from __future__ import annotations

from collections.abc import Iterable
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]


def distinct(values: Array) -> Array:
    """The values in increasing order, each once, shape (k,) [unit of `values`]: `np.unique` imports masked arrays."""
    ordered = np.sort(values, axis=None)
    once: Array = ordered[np.append(True, ordered[1:] != ordered[:-1])[: len(ordered)]]
    return once


def parts(values: Any, shapes: Iterable[tuple[str, tuple[int, ...]]]) -> dict[str, Any]:
    """Parts of the last axis of an array by name, each of shape (..., *its own). shapes: names and shapes, in order."""
    columns, begin = {}, 0
    for name, shape in shapes:
        end = begin + prod(shape)
        columns[name] = values[..., begin:end].reshape(values.shape[:-1] + shape)
        begin = end
    return columns
