# SPDX-License-Identifier: Apache-2.0
"""One StreamSteps call as writes that do not block and reads with a time limit. Used by one thread at a time."""
from __future__ import annotations

import atexit
import queue
import threading
import time
import weakref
from collections.abc import Iterator
from typing import Optional, Union

import grpc

from ._connection import Connection, error_from_call
from ._contacts import AnswerPart, parse_response
from ._memory import SharedRegion
from ._packets import MOST_BYTES, PacketChannel
from .errors import DeadlineExceededError, UnavailableError
from .v1 import step_pb2


_ON_STREAM = step_pb2.StreamStepsRequest(on_stream=step_pb2.OnStream()).SerializeToString()


class _Watchdog:
    """Cancels a call when an armed time passes. Its thread sleeps until the earliest armed time, and sleeps on if a later
    one was armed meanwhile: arming costs a lock, not a wake-up."""

    def __init__(self, call: grpc.Future) -> None:
        self.expired = False
        self._call = call
        self._changed = threading.Condition()
        # Under the lock:
        self._deadline: Optional[float] = None
        self._planned: Optional[float] = None  # wake-up time; None: only when notified
        self._ended = False
        self._thread: Optional[threading.Thread] = None

    def arm(self, seconds: float) -> None:
        with self._changed:
            self._deadline = time.monotonic() + seconds
            if self._thread is None:
                self._thread = threading.Thread(target=self._watch, name="warmfront-watchdog", daemon=True)
                self._thread.start()
            elif self._planned is None or self._deadline < self._planned:
                self._changed.notify()

    def disarm(self) -> None:
        with self._changed:
            self._deadline = None

    def end(self) -> None:
        with self._changed:
            self._ended = True
            self._changed.notify()

    def join(self, seconds: float) -> None:
        """After end()."""
        if self._thread is not None:
            self._thread.join(seconds)

    def _watch(self) -> None:
        with self._changed:
            while not self._ended:
                now = time.monotonic()
                if self._deadline is not None and now >= self._deadline:
                    self.expired = True
                    self._call.cancel()
                    return
                self._planned = self._deadline
                self._changed.wait(None if self._planned is None else self._planned - now)


class StepStream:
    """Raises WarmfrontError from reads when the call is over, DeadlineExceededError when it did not answer in time; the stream
    is of no use any more then."""

    def __init__(self, connection: Connection, session_id: str, traceparent: str = "") -> None:
        """traceparent: as of Connection.metadata()."""
        self._requests: queue.SimpleQueue[Optional[bytes]] = queue.SimpleQueue()
        self._connection = connection
        self._call = connection.stream(_serve(self._requests), session_id, traceparent)
        self._watchdog = _Watchdog(self._call)
        self._is_open = True
        self._packets: Optional[PacketChannel] = None  # None: all goes by the call
        self._on_stream = False  # the next message does
        _open_streams.add(self)

    def write(self, message: bytes) -> None:
        """Sends a serialized v1.StreamStepsRequest. Accepted even if the stream is over: reads report that."""
        if self._packets is not None:
            if self._connection.closed:  # packets would go on until the daemon knows
                self.close()
            try:
                if len(message) <= MOST_BYTES:
                    self._packets.send(message)
                    return
                self._packets.send(_ON_STREAM)
            except OSError:
                return  # its end is read
        self._requests.put(message)

    def share(self, path: str, session_id: str, token: bytes, size: int) -> None:
        """Messages go by packets from now on, where the daemon binds the stream; after the attach was answered."""
        try:
            self._packets = PacketChannel(path, session_id, token, size)
        except OSError:
            self._packets = None
        if not self._is_open and self._packets is not None:  # closed meanwhile by another thread
            self._packets.shut()

    @property
    def region(self) -> Optional[SharedRegion]:
        """Memory that frames may be in; None where none is shared."""
        return None if self._packets is None else self._packets.region

    def ask_for_memory(self, size: int) -> None:
        """As PacketChannel has it."""
        if self._packets is not None:
            self._packets.ask_for(size)

    def read(self, timeout: float) -> Union[AnswerPart, step_pb2.StreamStepsResponse]:
        """The next message; waits at most `timeout` seconds."""
        while self._packets is not None and not self._on_stream:
            try:
                packet = self._packets.receive(timeout)
            except TimeoutError:
                raise DeadlineExceededError(f"no answer within {timeout:g} s") from None
            if not packet:  # the rest comes by the call, and its end
                self._packets.close()
                self._packets = None
                break
            response = parse_response(packet)
            if isinstance(response, AnswerPart) or not response.HasField("on_stream"):
                return response
            self._on_stream = True
        response = self._read_call(timeout)
        self._on_stream = False
        return response

    def _read_call(self, timeout: float) -> Union[AnswerPart, step_pb2.StreamStepsResponse]:
        self._watchdog.arm(timeout)
        try:
            message = next(self._call)
        except StopIteration:
            # It ends with OK only after a detach, and none was sent.
            raise UnavailableError("the stream ended before its answers") from None
        except grpc.RpcError as error:
            if self._watchdog.expired:
                raise DeadlineExceededError(f"no answer within {timeout:g} s") from None
            raise error_from_call(error) from None
        finally:
            self._watchdog.disarm()
        return parse_response(message)

    def close(self) -> None:
        """Cancels the call if it is not over. Closing again does nothing."""
        if not self._is_open:
            return
        self._is_open = False
        packets = self._packets
        if packets is not None:
            packets.shut()
        self._requests.put(None)
        self._watchdog.end()
        self._call.cancel()

    def close_at_exit(self, deadline: float) -> None:
        """The same, and waits until no thread of the call or the watchdog is at work any more."""
        self.close()
        self._watchdog.join(max(0.0, deadline - time.monotonic()))
        while not self._call.done() and time.monotonic() < deadline:
            time.sleep(0.001)


_open_streams: weakref.WeakSet[StepStream] = weakref.WeakSet()


@atexit.register
def _close_all() -> None:
    """At exit the interpreter stops threads while they hold locks: a destructor that then takes one of these locks would wait
    forever. So streams that are still open are closed before that."""
    deadline = time.monotonic() + 2
    for stream in list(_open_streams):
        stream.close_at_exit(deadline)


def _serve(requests: queue.SimpleQueue[Optional[bytes]]) -> Iterator[bytes]:
    while (message := requests.get()) is not None:
        yield message
