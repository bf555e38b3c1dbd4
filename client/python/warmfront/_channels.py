# SPDX-License-Identifier: Apache-2.0
"""A client's connections: as many as its calls need. Thread-safe."""
from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import grpc

from .errors import FailedPreconditionError
from .v1 import admin_service_pb2_grpc, collision_service_pb2_grpc, session_pb2

# Default if the daemon states no number of calls per connection: half of a daemon's default, and below that of proxies
# (100 in HAProxy).
MOST_CALLS = 64


class Channel:
    """One connection, and the methods that are called on it."""

    def __init__(self, channel: grpc.Channel) -> None:
        self.channel = channel
        self.service: Any = collision_service_pb2_grpc.CollisionServiceStub(channel)  # type: ignore[no-untyped-call]
        self.admin: Any = admin_service_pb2_grpc.AdminServiceStub(channel)  # type: ignore[no-untyped-call]
        # Bytes both ways: this package itself joins and locates bulk data.
        self.stream: Any = channel.stream_stream("/warmfront.v1.CollisionService/StreamSteps")
        self.upload: Any = channel.stream_unary("/warmfront.v1.CollisionService/CreateSession",
                                                response_deserializer=session_pb2.CreateSessionResponse.FromString)
        self.change: Any = channel.stream_unary("/warmfront.v1.CollisionService/StreamChangeScene",
                                                request_serializer=session_pb2.ChangeSceneRequest.SerializeToString,
                                                response_deserializer=session_pb2.ChangeSceneResponse.FromString)
        self.calls = 0  # running; protected by the pool's lock


class ChannelPool:
    """A connection carries a limited number of concurrent calls (HTTP/2's SETTINGS_MAX_CONCURRENT_STREAMS); gRPC silently
    queues further calls until another ends, and a session's stream does not end. So calls are counted, and a new
    connection is opened when all are full."""

    def __init__(self, open_channel: Callable[[], grpc.Channel]) -> None:
        """open_channel creates a channel with its own connection."""
        self._open = open_channel
        self._lock = threading.Lock()
        # Protected by the lock. Channels are kept: gRPC itself closes connections after half an hour idle.
        self._most_calls = 1  # until a daemon has stated its limit
        self._channels: list[Channel] = []
        self._closed = False

    @property
    def closed(self) -> bool:
        return self._closed

    def take(self) -> Channel:
        """A channel with room for a call, to be given back when the call is over. FailedPreconditionError once
        closed."""
        with self._lock:
            if self._closed:
                raise FailedPreconditionError("the client is closed; connect again")
            for channel in self._channels:
                if channel.calls < self._most_calls:
                    break
            else:
                channel = Channel(self._open())
                self._channels.append(channel)
            channel.calls += 1
            return channel

    def give_back(self, channel: Channel) -> None:
        with self._lock:
            channel.calls -= 1

    def set_calls_per_channel(self, most: int) -> None:
        """The daemon's limit of calls per connection; 0: unknown. At most MOST_CALLS are used, since a connection is bound
        to about one core."""
        with self._lock:
            self._most_calls = min(most, MOST_CALLS) if most else MOST_CALLS

    def close(self) -> None:
        with self._lock:
            self._closed = True
            channels, self._channels = self._channels, []
        for channel in channels:
            channel.channel.close()
