# SPDX-License-Identifier: Apache-2.0
"""A stream's messages by packets beside gRPC, and the memory that goes with it (SharedMemoryRequest in step.proto). Used by
one thread at a time, but for `shut()`."""
from __future__ import annotations

import os
import socket
from typing import Optional

from ._memory import SharedRegion
from .v1 import step_pb2

MOST_BYTES = 61_440  # of a packet; see OnStream in step.proto
SUFFIX = ".shm"  # behind the path of the daemon's address
_BINDING = 2.0  # seconds


class _Socket(socket.socket):
    """Closed when nobody refers to it any more: who shuts it cannot know whether another thread still reads."""

    def __del__(self) -> None:
        self.close()


class PacketChannel:
    """`region`: whose blocks frames may be in."""

    region: SharedRegion

    def __init__(self, path: str, session_id: str, token: bytes, size: int) -> None:
        """Binds the stream of which the daemon offered the token. OSError where that cannot be, for whatever reason."""
        self._refused = False
        self._socket = _Socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            self._socket.settimeout(_BINDING)
            self._socket.connect(path)
            self._take_memory(step_pb2.SharedMemoryRequest(session_id=session_id, token=token, bytes=size))
        except BaseException:
            self._socket.close()
            raise

    def ask_for(self, size: int) -> None:
        """So much memory in place of what there is, while no frame is unanswered. Where it is refused, `region` is as before,
        and this does nothing from then on."""
        if self._refused:
            return
        try:
            self._take_memory(step_pb2.SharedMemoryRequest(bytes=size))
        except OSError:
            self._refused = True

    def send(self, message: bytes) -> None:
        """OSError where the connection is gone; what the daemon sent before can still be read."""
        self._socket.settimeout(None)
        self._socket.send(message)

    def receive(self, timeout: float) -> bytes:
        """The next message; empty at the end of them. TimeoutError after `timeout` seconds."""
        self._socket.settimeout(timeout)
        while True:
            try:
                return self._socket.recv(MOST_BYTES)
            except ConnectionResetError:
                # The daemon closed it with something unread; what it sent before comes next.
                continue
            except TimeoutError:
                raise
            except OSError:
                return b""

    def shut(self) -> None:
        """From any thread: who waits for a message gets the end of them."""
        try:
            self._socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass

    def close(self) -> None:
        self._socket.close()

    def _take_memory(self, request: step_pb2.SharedMemoryRequest) -> None:
        self._socket.settimeout(_BINDING)
        self._socket.send(step_pb2.StreamStepsRequest(shared_memory=request).SerializeToString())
        message, files, _, _ = socket.recv_fds(self._socket, MOST_BYTES, 1)
        try:
            granted = _parsed(message)
            if not files or granted is None:
                raise OSError("the daemon shares no memory")
            try:
                self.region = SharedRegion(files[0], granted)
            except ValueError as error:
                raise OSError(str(error)) from None
        finally:
            for file in files:
                os.close(file)


def _parsed(message: bytes) -> Optional[int]:
    """How much was granted."""
    response = step_pb2.StreamStepsResponse()
    try:
        response.ParseFromString(message)
    except Exception:  # protobuf's DecodeError is in a module without types
        return None
    return int(response.shared_memory.bytes) if response.HasField("shared_memory") else None
