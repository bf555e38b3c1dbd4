# SPDX-License-Identifier: Apache-2.0
"""Connecting to a daemon. A Client is thread-safe: sessions of one client may be used from different threads."""
from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Any, Optional, Union

from ._private_daemon import PrivateDaemon
from ._state import SceneState
from ._trace import traceparent_of
from ._uncopied import Uncopied
from ._copies import Copies
from .batch import Batch
from .errors import InvalidArgumentError
from .info import ServerInfo, SessionInfo
from ._question import frame_number_of, session_id_of
from .options import Options, Timeouts, Security, check_options
from .scene import Body, PairFilters, filters_of
from .session import Session
from .v1 import session_pb2

if TYPE_CHECKING:  # who computes in this process needs no gRPC, and does not wait for it
    from ._connection import Connection


def connect(address: Optional[str] = None, *, security: Security = Security(), timeouts: Timeouts = Timeouts(),
            flags: Sequence[str] = (), patience: Optional[Timeouts] = None, shared_memory: bool = True,
            traceparent: str = "") -> Client:
    """Connects to `HOST:PORT` or `unix:PATH`; InvalidArgumentError, which is a ValueError, for anything else, such as an URL.

    Without an address a daemon of this process's own is started: the program that $WARMFRONTD names, or the one beside this
    package, or the one in PATH, on a socket that only this user can open. `flags` are its command line's, such as
    ["--threads", "4"]; WARMFRONT_* variables do not reach it. It ends with the client and its sessions, and with this
    process, however that ends. A session does not survive it.

    patience: the name of `timeouts` before.

    shared_memory: with a daemon that is reached by a Unix socket, or is this process's own, and offers it, positions and
    answers go through memory that both see, with the same bits; see README.md. Otherwise all goes by the socket.

    traceparent: the caller's span, as W3C Trace Context says it: spans of frames, where the daemon exports traces, are below it,
    if its flag says that it is sampled. Sent with every call.

    UnavailableError, with the system's reason (to learn it takes up to two seconds more), when no daemon answers within
    `timeouts.call`, which is also what a failed TLS handshake looks like, and when none can be started; UnauthenticatedError for a token that it does not know;
    InvalidArgumentError for files that cannot be read, for a token that would travel in the clear, and for a traceparent that
    is none.
    """
    from ._connection import Connection

    traceparent_of(traceparent)

    if patience is not None:
        timeouts = patience
    private = None
    if address is None:
        if security != Security():
            raise InvalidArgumentError("security: the daemon that is started without an address is this process's own, and "
                                       "knows no certificates or tokens; give an address or no security")
        private = PrivateDaemon(flags, timeouts.call)
        address = private.address
    elif flags:
        raise InvalidArgumentError("flags: they are of a daemon that is started; give either an address or flags")
    connection = Connection(address, security, timeouts, private, shared_memory, traceparent)
    try:
        connection.server_info()
    except BaseException:
        connection.close()
        raise
    return Client(connection)


class Client(Uncopied):
    """Made by `connect()`. Its sessions share connections, of which it opens as many as they need; these, and a daemon
    that was started for them, end with the last session, or by `close()`. copy and pickle raise TypeError."""

    _instead = "connect() again"

    def __init__(self, connection: Connection) -> None:
        """Internal: use `connect()`."""
        self._connection = connection

    def session(
        self,
        positions: Any,
        faces: Any = None,
        *,
        edges: Any = None,
        bodies: Sequence[Body] = (),
        excluded_pairs: Sequence[tuple[int, int]] = (),
        filters: Union[PairFilters, Mapping[str, Any], None] = None,
        thickness: Any = None,
        options: Options = Options(),
        id: str = "",
        first_frame: int = 0,
        traceparent: str = "",
    ) -> Session:
        """Uploads a scene and its positions at the first frame.

        positions (n, 3) float32 or float64, finite, scene length unit: they travel and stay as they are, and those of every
        frame become alike; lists, and numbers of other types, become float64 where that holds them exactly. faces (m, 3)
        vertex indices of any integer type; a face may repeat one, and is the segment or point that it names; None: none.
        edges (k, 2): of two different vertices each, hair and rods; the scene's edges are these and the sides of faces, each
        once. All arrays here and below may be whatever numpy or DLPack reads without the GPU. Vertices in no face and no edge
        are points: tested against faces, and, where a separation or thickness counts, against edges of no face and each other.
        bodies: ranges that cover all vertices in order; none: all is deformable. excluded_pairs: of bodies by index, not tested against each other. filters: pairs of
        features that do not count, `PairFilters` or a dict of its fields; the rest shape, where they need one and have none,
        is these positions. thickness: (n), of each vertex, or one number for all, scene length unit, besides its body's (see
        `Body`); None: none.
        id: a UUID, random when empty. first_frame: the number of these positions; the first step is the
        next. traceparent: of this session's frames, in place of the client's: see `connect()`.

        UnimplementedError for filters, thickness and edges where the daemon is older than they are.
        InvalidArgumentError for bad input, AlreadyExistsError for an id that is taken, ResourceExhaustedError beyond the
        daemon's limits.
        """
        from ._remote import Remote
        from ._resume import Link

        check_options(options)
        traceparent_of(traceparent)
        state = SceneState(positions, faces, bodies, excluded_pairs, filters_of(filters), thickness, edges)
        header = session_pb2.SessionHeader(session_id=session_id_of(id) or str(uuid.uuid4()), first_frame=frame_number_of(first_frame))
        options.put_into(header.options)
        link = Link(self._connection, header, state, options, traceparent)
        link.open()
        return Session(Remote(link))

    def batch(
        self,
        count: int,
        positions: Any,
        faces: Any = None,
        *,
        edges: Any = None,
        bodies: Sequence[Body] = (),
        excluded_pairs: Sequence[tuple[int, int]] = (),
        shared: Sequence[tuple[Body, Any, Any]] = (),
        filters: Union[PairFilters, Mapping[str, Any], None] = None,
        thickness: Any = None,
        options: Options = Options(),
        id: str = "",
    ) -> Batch:
        """`count` copies of one scene that know nothing of each other, such as the environments of a learner, as one session:
        one frame, one answer, one upload. Each is in a world of its own (`Body.world`), 1 to count.

        positions (n, 3), of every copy alike, or (count, n, 3); faces, edges, bodies and excluded_pairs as in `session()`, of
        one copy; without bodies each copy is one, deformable. shared: bodies that are there for all copies, a ground say:
        (`Body`, faces, positions) each, numbered from 0, None and None of a half-space; they come first among the session's bodies and vertices.
        filters and thickness as in `session()`, of one copy: of the shared vertices' none are told, but that a number for
        thickness is theirs too.

        Errors as of `session()`; UnimplementedError where the daemon is older than worlds.
        """
        copies = Copies(count, positions, faces, edges, bodies, shared)
        return Batch(self.session(copies.positions(), copies.faces(), edges=copies.edges(), bodies=copies.all_bodies(),
                                  excluded_pairs=copies.excluded(excluded_pairs), filters=copies.filters(filters),
                                  thickness=copies.thickness(thickness), options=options, id=id), copies)

    def server_info(self) -> ServerInfo:
        """Information about one daemon: behind a proxy, the one that answers."""
        return ServerInfo.read_from(self._connection.server_info())

    def list_sessions(self) -> list[SessionInfo]:
        """The sessions of this principal."""
        return [SessionInfo.read_from(session) for session in self._connection.list()]

    def get_session(self, id: str) -> SessionInfo:
        """NotFoundError for an unknown session. Keeps it from expiring, which `list_sessions()` does not."""
        return SessionInfo.read_from(self._connection.get(id))

    def delete_session(self, id: str) -> None:
        """NotFoundError for an unknown session."""
        self._connection.remove(id)

    def list_all_sessions(self) -> list[SessionInfo]:
        """Those of all principals. For administrators, PermissionDeniedError for others."""
        return [SessionInfo.read_from(owned.session, owned.principal) for owned in self._connection.list_all()]

    def delete_any_session(self, id: str, principal: Optional[str] = None) -> None:
        """As `delete_session()`, for a session of any principal; FailedPreconditionError where several principals use the id and
        `principal` does not select one. For administrators."""
        self._connection.remove_any(id, principal)

    def close(self) -> None:
        """Ends the connections, and a daemon that was started for them; sessions that are open fail."""
        self._connection.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, kind: Optional[type[BaseException]], error: Optional[BaseException],
                 trace: Optional[TracebackType]) -> None:
        self.close()
