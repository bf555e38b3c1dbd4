# SPDX-License-Identifier: Apache-2.0
"""Memory that a daemon on the same machine sees as well, in blocks that are free again when nothing refers to them.
Thread-safe."""
from __future__ import annotations

import mmap
import threading
from collections.abc import Mapping
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

_ALIGNMENT = 64


def room_of(size: int) -> int:
    """What a block of `size` bytes takes."""
    return (max(size, 1) + _ALIGNMENT - 1) // _ALIGNMENT * _ALIGNMENT


class SharedRegion:
    """A memfd that the daemon made and sealed. It stays mapped as long as an array refers to it, whatever becomes of the
    daemon."""

    def __init__(self, file: int, size: int) -> None:
        """OSError and ValueError where it cannot be mapped. The descriptor stays the caller's."""
        self.size = size
        self._map = mmap.mmap(file, size)
        self._address = int(np.frombuffer(self._map, np.uint8).ctypes.data)
        self._lock = threading.Lock()
        self._taken: dict[int, int] = {}  # under the lock: offset and length

    def take(self, size: int) -> Optional[Block]:
        """None where there is no room."""
        length = room_of(size)
        at = 0
        with self._lock:
            for offset, taken in sorted(self._taken.copy().items()):
                if offset - at >= length:
                    break
                at = offset + taken
            if self.size - at < length:
                return None
            self._taken[at] = length
        return Block(self, at, size)

    def address(self, offset: int) -> int:
        return self._address + offset

    def give_back(self, offset: int) -> None:
        # No lock: it may be called wherever garbage is collected, by a thread that has it. A dict's own operations are
        # atomic, and who looks for room works on a copy.
        self._taken.pop(offset, None)


class _Holder:
    """What numpy keeps as the base of a block's arrays, however they are sliced: gives the block back with the last."""

    def __init__(self, region: SharedRegion, offset: int, size: int) -> None:
        self._region = region
        self._offset = offset
        self.__array_interface__: Mapping[str, Any] = {"version": 3, "typestr": "|u1", "shape": (size,),
                                                       "data": (region.address(offset), False)}

    def __del__(self) -> None:
        self._region.give_back(self._offset)


class Block:
    """Bytes of a region. Taken for as long as this, `data`, or any array or view made of it lives."""

    def __init__(self, region: SharedRegion, offset: int, size: int) -> None:
        self.region = region
        self.offset = offset
        self.size = size
        self.data: npt.NDArray[np.uint8] = np.asarray(_Holder(region, offset, size))
