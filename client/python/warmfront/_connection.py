# SPDX-License-Identifier: Apache-2.0
"""The connections to a daemon and its small calls. Thread-safe."""
from __future__ import annotations

import json
import os
import socket
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Optional

import grpc

from . import _packets
from ._channels import Channel, ChannelPool
from ._contacts import error_from
from ._pieces import pieces_of
from ._private_daemon import PrivateDaemon
from ._security import read_credentials, what_to_try
from ._wire import Bytes, field
from .errors import (DeadlineExceededError, InvalidArgumentError, UnavailableError, UnimplementedError, WarmfrontError,
                     class_of, may_resume)
from .options import Timeouts, Security
from .v1 import admin_service_pb2, errors_pb2, session_pb2, step_pb2

# For a first upload, before the daemon's answer states its message limit: well below the least limit, 64 KiB.
_UPLOAD_CHUNK = 60 << 10
_BACKOFF = 0.05
_PRIVATE_WAIT = 2.0  # seconds for a daemon of one's own to answer: one that was killed is known to have ended by then
# Sessions a page: below the least limit likewise.
_PAGE_SIZE = 100
# Fields of an upload's messages, by name.
_PARTS = session_pb2.CreateSessionRequest.DESCRIPTOR.fields_by_name
# What a daemon without a feature would make of input that needs it.
_TOO_OLD_FOR = {
    session_pb2.FEATURE_PAIR_FILTERS: "filters: the daemon is older than they are, and would count what they leave out; "
                                      "update it, or leave them out",
    session_pb2.FEATURE_THICKNESS: "thickness: the daemon is older than it is, and would miss contacts; update it, or leave "
                                   "it out",
    session_pb2.FEATURE_WORLDS: "worlds: the daemon is older than they are, and would count contacts between them; update "
                                "it, or give each world a session of its own",
    session_pb2.FEATURE_SCREW: "screw: the daemon is older than it is, and would move the body along lines; update it, or give "
                               "several poses for each turn",
    session_pb2.FEATURE_EDGES: "edges: the daemon is older than they are, and would miss contacts; update it, or leave them "
                               "out",
    session_pb2.FEATURE_HALF_SPACES: "half_space: the daemon is older than half-spaces; update it, or give a mesh instead",
    session_pb2.FEATURE_OPTION_CHANGES: "the daemon is older than changes of options and excluded pairs; update it, or create "
                                        "the session again with the others",
    session_pb2.FEATURE_REPLACE: "the daemon is older than replacing elements and bodies, and thickness of vertices that are "
                                 "added; update it, or create the session again with the other scene",
}


def _features_in(header: session_pb2.SessionHeader) -> list[session_pb2.Feature]:
    """What a daemon must know that takes such a session."""
    features = []
    if header.HasField("filters"):
        features.append(session_pb2.FEATURE_PAIR_FILTERS)
    if header.vertex_thickness or any(body.thickness != 0 and body.kind != session_pb2.BODY_KIND_REMOVED
                                      for body in header.bodies):
        features.append(session_pb2.FEATURE_THICKNESS)
    if any(body.world != 0 and body.kind != session_pb2.BODY_KIND_REMOVED for body in header.bodies):
        features.append(session_pb2.FEATURE_WORLDS)
    if any(body.screw and body.kind != session_pb2.BODY_KIND_REMOVED for body in header.bodies):
        features.append(session_pb2.FEATURE_SCREW)
    if header.edge_count > 0:
        features.append(session_pb2.FEATURE_EDGES)
    if any(body.HasField("half_space") for body in header.bodies):
        features.append(session_pb2.FEATURE_HALF_SPACES)
    return features


def _took(session: session_pb2.SessionInfo, feature: session_pb2.Feature) -> bool:
    """Does the session have what only a daemon with the feature takes?"""
    if feature in (session_pb2.FEATURE_EDGES, session_pb2.FEATURE_HALF_SPACES):
        return True  # one that does not know these refuses their bytes, or a body without vertices
    if feature == session_pb2.FEATURE_WORLDS:
        return bool(session.world_count > 0)
    if feature == session_pb2.FEATURE_SCREW:
        return bool(session.screw_count > 0)
    return bool(session.most_thickness > 0 if feature == session_pb2.FEATURE_THICKNESS else session.HasField("filters"))


# gRPC retries idempotent calls when the connection breaks or the daemon restarts (about two seconds). Steps, uploads
# and changes are resumed in _resume.py.
_SERVICE_CONFIG = json.dumps({"methodConfig": [{
    "name": [{"service": "warmfront.v1.CollisionService", "method": method}
             for method in ("GetServerInfo", "DeleteSession", "GetSession", "ListSessions")],
    "retryPolicy": {"maxAttempts": 5, "initialBackoff": "0.1s", "maxBackoff": "1s", "backoffMultiplier": 2,
                    "retryableStatusCodes": ["UNAVAILABLE"]}}]})

_ARGUMENTS = [
    ("grpc.service_config", _SERVICE_CONFIG),
    # The daemon chooses the size of an answer's chunks.
    ("grpc.max_receive_message_length", -1),
    # One connection per channel: a connection is bound to about one core.
    ("grpc.use_local_subchannel_pool", 1),
    ("grpc.initial_reconnect_backoff_ms", 100),
    # Sooner than the last retry of a call: else it fails though the daemon is there again.
    ("grpc.max_reconnect_backoff_ms", 1000),
    # Despite its name this is the time limit for connecting, handshakes included: three round trips on a possibly slow
    # line, to a possibly busy daemon.
    ("grpc.min_reconnect_backoff_ms", 10_000),
    # Detects a daemon that vanished silently within a minute; daemons allow a ping every ten seconds.
    ("grpc.keepalive_time_ms", 30_000),
    ("grpc.keepalive_timeout_ms", 20_000),
    # Ignore a web proxy from the environment: the address is that of the daemon or of its own proxy.
    ("grpc.enable_http_proxy", 0),
]

_ADDRESS_EXPECTED = "HOST:PORT (an IPv6 host in brackets) or unix:PATH is expected, the port in [1, 65535], the path of 107 bytes at most"
_LONGEST_PATH = 107  # sockaddr_un


def check_address(address: str) -> None:
    """InvalidArgumentError for what has not the form of one: gRPC takes what has no port for a web server's."""
    if isinstance(address, str):
        if address.startswith("unix:"):
            folder = os.path.dirname(address[len("unix:"):])
            if folder and not os.path.exists(folder):  # no daemon will listen there, and nobody should wait for one
                raise UnavailableError(f"{address}: there is no folder {folder}; is this the path of the daemon's --listen?")
            if 0 < len(os.fsencode(address)) - len("unix:") <= _LONGEST_PATH:
                return
        else:
            host, _, port = address.rpartition(":")
            bare = ":" not in host or (host.startswith("[") and host.endswith("]"))
            if host and bare and port.isascii() and port.isdigit() and 1 <= int(port) <= 65535:
                return
    raise InvalidArgumentError(f"address {address!r}: {_ADDRESS_EXPECTED}")


def error_from_call(call: Any) -> WarmfrontError:
    """The exception for a failed gRPC call, not raised. Blocks until the call is over."""
    code = call.code().value[0]
    for key, value in call.trailing_metadata() or ():
        if key == "grpc-status-details-bin":
            try:
                status = errors_pb2.Status.FromString(value)
            except Exception:  # protobuf's DecodeError: details of another service, for example a proxy
                break
            return error_from(code, call.details() or "", status.details)
    return class_of(code)(call.details() or "")


class Connection:
    """To `HOST:PORT` or `unix:PATH`."""

    def __init__(self, address: str, security: Security, timeouts: Timeouts, private: Optional[PrivateDaemon] = None,
                 shares_memory: bool = True, traceparent: str = "") -> None:
        """private: the daemon of that address, which ends with the connection."""
        check_address(address)
        credentials = read_credentials(address, security)
        if not isinstance(timeouts, Timeouts):
            raise InvalidArgumentError(f"timeouts: a {type(timeouts).__name__}; give a Timeouts(call=...)")
        self.address = address
        self.timeouts = timeouts
        self._private = private
        self._shares_memory = shares_memory
        self._encrypted = credentials.channel is not None
        self._metadata = [("authorization", credentials.authorization)] if credentials.authorization else []
        self._traceparent = traceparent
        arguments = list(_ARGUMENTS)
        if security.server_name:
            arguments.append(("grpc.ssl_target_name_override", security.server_name))
        if credentials.channel is not None:
            self._channels = ChannelPool(lambda: grpc.secure_channel(address, credentials.channel, arguments))
        else:
            self._channels = ChannelPool(lambda: grpc.insecure_channel(address, arguments))

    def metadata(self, session_id: str = "", traceparent: str = "") -> list[tuple[str, str]]:
        """Of every call: the credentials, the session id if any, and this traceparent or else the connection's."""
        span = traceparent or self._traceparent
        return (self._metadata + ([("warmfront-session", session_id)] if session_id else [])
                + ([("traceparent", span)] if span else []))

    def stream(self, requests: Iterator[bytes], session_id: str, traceparent: str = "") -> Any:
        """Begins a StreamSteps call of serialized messages, on a connection with room for it."""
        channel = self._channels.take()
        try:
            call = channel.stream(requests, metadata=self.metadata(session_id, traceparent))
        except BaseException:
            self._channels.give_back(channel)
            raise
        # Runs at once if the call is already over.
        call.add_done_callback(lambda _: self._channels.give_back(channel))
        return call

    @property
    def memory_socket(self) -> Optional[str]:
        """The path of the socket of shared memory, where the daemon may be asked for it."""
        if not self._shares_memory or not self.address.startswith("unix:") or not hasattr(socket, "recv_fds"):
            return None
        return self.address[len("unix:"):] + _packets.SUFFIX

    @property
    def is_private(self) -> bool:
        """Whether the daemon was started for this connection, and nobody starts it again."""
        return self._private is not None

    def server_info(self, timeout: Optional[float] = None, session_id: str = "") -> Any:
        """v1.GetServerInfoResponse, of the daemon where the session is to be; waits for one that is not there yet, for
        `timeouts.call` seconds unless `timeout` says otherwise."""
        self._check_private()
        # Only a call that does not wait for the connection learns why it failed; who has little time does without.
        last = 2.0 if timeout is None or timeout > 4 else 0.0
        whole = self.timeouts.call + last if timeout is None else timeout
        error: WarmfrontError
        try:
            return self._ask_info(session_id, whole - last, wait_for_ready=True)
        except (DeadlineExceededError, UnavailableError) as failed:
            error = failed
        if last > 0:
            try:
                return self._ask_info(session_id, last, wait_for_ready=False)
            except UnavailableError as failed:
                error = failed
            except DeadlineExceededError:
                pass
        self._check_private()
        raise UnavailableError(f"{self.address}: no Warmfront daemon answers ({error.message}); "
                               f"{what_to_try(error.message, self._encrypted)}", reason=error.reason)

    def find_daemon(self, most: float, session_id: str) -> None:
        """UnavailableError where none answers within `most` seconds, or this connection's own has ended."""
        self.server_info(most if self._private is None else min(most, _PRIVATE_WAIT), session_id)

    def wait_for_daemon(self, session_id: str) -> None:
        """For one to make the session in. UnavailableError where none answers within the resume timeout."""
        deadline = time.monotonic() + self.timeouts.resume
        while True:
            try:
                return self.find_daemon(max(deadline - time.monotonic(), 0.001), session_id)
            except WarmfrontError as error:
                if not may_resume(error):
                    raise
                if time.monotonic() + _BACKOFF >= deadline:
                    raise self.not_in_time(session_id, "made", error) from None
            time.sleep(_BACKOFF)

    def not_in_time(self, session_id: str, done: str, error: WarmfrontError, ended: str = "") -> UnavailableError:
        """The error of a session that was not made, or resumed, within the resume timeout; `error` is the last try's."""
        return UnavailableError(f"session {session_id} could not be {done} within the resume timeout of {self.timeouts.resume:g} s: "
                                f"{error.message}{ended}")

    def _check_private(self) -> None:
        """UnavailableError where the daemon of this connection has ended: nobody starts it again."""
        ended = self._private.why_ended() if self._private is not None else None
        if ended is not None:
            raise UnavailableError(f"the daemon that was started for this client has ended: {ended}", reason="DAEMON_ENDED")

    def _ask_info(self, session_id: str, timeout: float, wait_for_ready: bool) -> Any:
        info = self._call(lambda channel: channel.service.GetServerInfo, session_pb2.GetServerInfoRequest(), session_id, timeout,
                          wait_for_ready=wait_for_ready)
        self._channels.set_calls_per_channel(info.limits.max_streams)
        return info

    def need(self, features: Sequence[session_pb2.Feature], session_id: str, timeout: Optional[float] = None) -> None:
        """UnimplementedError where the daemon that serves this session lacks one of the features."""
        known = self.server_info(timeout, session_id).features if features else ()
        for feature in features:
            if feature not in known:
                raise UnimplementedError(_TOO_OLD_FOR[feature])

    def _has(self, feature: session_pb2.Feature, session_id: str) -> bool:
        """Where it cannot be asked, the call that needs it tells why."""
        try:
            return feature in self.server_info(None, session_id).features
        except WarmfrontError:
            return False

    def create(self, header: session_pb2.SessionHeader, arrays: Sequence[tuple[str, Bytes]],
               timeout: Optional[float] = None) -> Any:
        """Uploads a scene, with arrays by their names in v1.CreateSessionRequest; waits for a daemon that is not there yet,
        for `timeouts.create` seconds unless `timeout` says otherwise. v1.CreateSessionResponse. Fails as need() for
        a header that announces what needs a feature."""
        def requests() -> Iterator[bytes]:
            yield b"".join(field(_PARTS["header"].number, header.SerializeToString()))
            for name, data in arrays:
                view = memoryview(data)
                for at in range(0, len(view), _UPLOAD_CHUNK):
                    yield b"".join(field(_PARTS[name].number, view[at:at + _UPLOAD_CHUNK]))
        features = _features_in(header)
        self.need(features, header.session_id, timeout)
        response = self._call(lambda channel: channel.upload, requests(), header.session_id, timeout or self.timeouts.create,
                              wait_for_ready=True)
        # Another daemon than the one that was asked, behind a proxy, would take the scene without what it does not know of.
        for feature in features:
            if not _took(response.session, feature):
                self.remove(header.session_id)
                raise UnimplementedError(_TOO_OLD_FOR[feature])
        return response

    def change(self, request: session_pb2.ChangeSceneRequest) -> Any:
        """v1.ChangeSceneResponse. In pieces where it is large, unless the daemon is older than that."""
        if request.ByteSize() > _UPLOAD_CHUNK and self._has(session_pb2.FEATURE_STREAMED_CHANGES, request.session_id):
            return self._call(lambda channel: channel.change, pieces_of(request, _UPLOAD_CHUNK), request.session_id,
                              self.timeouts.create)
        return self._call(lambda channel: channel.service.ChangeScene, request, request.session_id, self.timeouts.create)

    def get(self, session_id: str) -> Any:
        """v1.SessionInfo."""
        request = session_pb2.GetSessionRequest(session_id=session_id)
        return self._call(lambda channel: channel.service.GetSession, request, session_id).session

    def _pages(self, method: Callable[[Any], Any], request: Any) -> list[Any]:
        """The sessions of all pages."""
        request.page_size = _PAGE_SIZE
        sessions: list[Any] = []
        while True:
            page = self._call(method, request)
            sessions += page.sessions
            if not page.next_page_token:
                return sessions
            request.page_token = page.next_page_token

    def list(self) -> Any:
        """v1.SessionInfo of this principal's sessions."""
        return self._pages(lambda channel: channel.service.ListSessions, session_pb2.ListSessionsRequest())

    def remove(self, session_id: str) -> None:
        request = session_pb2.DeleteSessionRequest(session_id=session_id)
        self._call(lambda channel: channel.service.DeleteSession, request, session_id)

    def list_all(self) -> Any:
        """v1.OwnedSession of all sessions; needs the admin role."""
        return self._pages(lambda channel: channel.admin.ListAllSessions, admin_service_pb2.ListAllSessionsRequest())

    def remove_any(self, session_id: str, principal: Optional[str]) -> None:
        request = admin_service_pb2.DeleteAnySessionRequest(session_id=session_id, principal=principal)
        self._call(lambda channel: channel.admin.DeleteAnySession, request, session_id)

    @property
    def closed(self) -> bool:
        return self._channels.closed

    def close(self) -> None:
        self._channels.close()
        if self._private is not None:
            self._private.end()

    def _call(self, method_of: Callable[[Channel], Any], request: Any, session_id: str = "", timeout: Optional[float] = None,
              wait_for_ready: bool = False) -> Any:
        channel = self._channels.take()
        try:
            return method_of(channel)(request, timeout=timeout or self.timeouts.call, metadata=self.metadata(session_id),
                                      wait_for_ready=wait_for_ready)
        except grpc.RpcError as error:
            raise error_from_call(error) from None
        finally:
            self._channels.give_back(channel)
