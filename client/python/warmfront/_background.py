# SPDX-License-Identifier: Apache-2.0
"""A session's calls as futures and coroutines: one after the other, on a thread of the session's own. Thread-safe."""
from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Optional, TypeVar

T = TypeVar("T")


class Background:
    """The thread starts with the first call, and ends with this object."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._executor: Optional[ThreadPoolExecutor] = None

    def submit(self, call: Callable[..., T], *arguments: Any, **named: Any) -> Future[T]:
        """Its result, in time; cancelling it has an effect only before it has begun."""
        with self._lock:
            if self._executor is None:
                self._executor = ThreadPoolExecutor(max_workers=1, thread_name_prefix="warmfront-session")
            return self._executor.submit(call, *arguments, **named)

    def end(self) -> None:
        """What has not begun is cancelled. Does not wait."""
        with self._lock:
            if self._executor is not None:
                self._executor.shutdown(wait=False, cancel_futures=True)
                self._executor = None
