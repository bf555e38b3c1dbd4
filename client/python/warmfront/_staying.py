# SPDX-License-Identifier: Apache-2.0
"""Which rows of a frame of all positions say nothing: those of static bodies are repeated, of removed ones given anyhow. A pure
function."""
from __future__ import annotations

from collections.abc import Sequence
from typing import Union

import numpy as np
import numpy.typing as npt

from .scene import Body

Selection = Sequence[Union[slice, npt.NDArray[np.int64]]]

_MOST_SLICES = 16  # of more, there may be thousands, one array of their rows is faster


def rows_that_stay(bodies: Sequence[Body]) -> Selection:
    """Each indexes an array of all rows."""
    ranges: list[list[int]] = []
    for body in bodies:
        if body.kind not in ("static", "removed") or body.first_vertex is None:
            continue
        begin, end = body.first_vertex, body.first_vertex + body.vertex_count
        if ranges and ranges[-1][1] == begin:
            ranges[-1][1] = end
        else:
            ranges.append([begin, end])
    if len(ranges) <= _MOST_SLICES:
        return [slice(begin, end) for begin, end in ranges]
    return [np.concatenate([np.arange(begin, end) for begin, end in ranges])]
