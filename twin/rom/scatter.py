"""Numbers put at places of an array or added there: numpy and JAX arrays alike, nothing is changed in place."""

from __future__ import annotations

from typing import Any

import numpy as np

Array = Any


def put(xp: Any, array: Array, index: Any, values: Array) -> Array:
    """The array with values at `array[index]`."""
    if xp is not np:
        return xp.asarray(array).at[index].set(values)
    result = array.copy()
    result[index] = values
    return result


def add(xp: Any, array: Array, index: Any, values: Array) -> Array:
    """The array with values added to `array[index]`, one after the other where an index is named more than once."""
    if xp is not np:
        return xp.asarray(array).at[index].add(values)
    result = array.copy()
    np.add.at(result, index, values)
    return result
