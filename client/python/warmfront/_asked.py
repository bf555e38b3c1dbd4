# SPDX-License-Identifier: Apache-2.0
"""What the engine in this process was asked. Plain values."""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Optional

import numpy as np
import numpy.typing as npt

from . import _engine
from ._question import Question


@dataclass(frozen=True, eq=False)
class Moved:
    """What a frame gives: of bodies at poses, which no longer are, and which are, and where."""

    whole: bool
    bodies: tuple[int, ...] = ()
    posed: tuple[int, ...] = ()
    matrices: Iterable[npt.NDArray[np.float64]] = ()  # (3, 4), of these


NOTHING = Moved(False)
ALL = Moved(True)


@dataclass(frozen=True, eq=False)
class Asked:
    """What was submitted. Without a question: a commit."""

    number: int
    question: Optional[Question]
    moved: Moved
    fraction: float
    on_its_way: _engine.Submitted

    @property
    def counts(self) -> bool:
        return self.question is None or self.question.counts
