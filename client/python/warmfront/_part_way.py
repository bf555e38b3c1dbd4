# SPDX-License-Identifier: Apache-2.0
"""Where part of a linear motion ends: the formula of v1.Commit, bit for bit as the daemon has it. Pure functions."""
from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def part_way(start: Array, end: Array, fraction: float, dtype: np.dtype[Any]) -> npt.NDArray[np.float64]:
    """start + fraction * (end - start), of float64 arrays, each operation rounded once, then rounded to `dtype`; `end`
    itself at fraction 1 and `start` itself at 0. Where end - start is beyond float64: (1 - fraction) * start + fraction *
    end. As float64."""
    if fraction == 1:
        return end
    if fraction == 0:
        return start
    return _between(start, end, fraction, dtype)


def _between(start: Array, end: Array, fraction: Any, dtype: np.dtype[Any]) -> npt.NDArray[np.float64]:
    """The formula of part_way() alone, at 0 and 1 too."""
    with np.errstate(over="ignore", invalid="ignore"):
        difference = end - start
        at = start + fraction * difference
        wide = ~np.isfinite(difference)
        if wide.any():
            at = np.where(wide, (1 - fraction) * start + fraction * end, at)
    rounded: npt.NDArray[np.float64] = at.astype(dtype).astype(np.float64)
    return rounded


def vertices_part_way(start: Array, end: Array, fraction: float, dtype: np.dtype[Any]) -> npt.NDArray[np.float64]:
    """The same of positions (k, 3), where a vertex that does not move stays where it is, bit for bit."""
    still = (bits(start) == bits(end)).all(axis=1)
    return np.where(still[:, None], end, part_way(start, end, fraction, dtype))


def each_part_way(start: Array, end: Array, fractions: Array, dtype: np.dtype[Any]) -> npt.NDArray[np.float64]:
    """The same of positions (n, k, 3), with a fraction (n) for each row of them."""
    return _each(start, end, fractions, (bits(start) == bits(end)).all(axis=2, keepdims=True), dtype)


def _each(start: Array, end: Array, fractions: Array, still: Array, dtype: np.dtype[Any]) -> npt.NDArray[np.float64]:
    share = fractions[:, None, None]
    at = np.where(still | (share == 1), end, _between(start, end, share, dtype))
    return np.where(share == 0, start, at)


def pose_part_way(start: Array, end: Array, fraction: float, dtype: np.dtype[Any]) -> npt.NDArray[np.float64]:
    """The same of the numbers of a pose (3, 4); for fractions between 0 and 1 it is in general no rotation."""
    return end if (start == end).all() else part_way(start, end, fraction, dtype)


def each_pose_part_way(start: Array, end: Array, fractions: Array, dtype: np.dtype[Any]) -> npt.NDArray[np.float64]:
    """The same of poses (n, 3, 4), with a fraction (n) for each."""
    return _each(start, end, fractions, (start == end).all(axis=(1, 2), keepdims=True), dtype)


def bits(values: Array) -> npt.NDArray[np.uint64]:
    """Of float64."""
    return np.ascontiguousarray(values, np.float64).view(np.uint64)
