# SPDX-License-Identifier: Apache-2.0
"""What there is once: sessions and connections."""
from __future__ import annotations

from typing import NoReturn, SupportsIndex


class Uncopied:
    """copy.copy(), copy.deepcopy() and pickle raise TypeError: two objects would each think that the one state, and what is on
    its way, were theirs."""

    _instead: str  # what to do

    def __reduce_ex__(self, protocol: SupportsIndex) -> NoReturn:
        raise TypeError(f"a {type(self).__name__} is not copied or pickled: there is one state, which it moves; {self._instead}")
