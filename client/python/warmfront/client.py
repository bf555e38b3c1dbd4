# SPDX-License-Identifier: Apache-2.0
"""Connecting to a daemon. A Client is thread-safe: sessions of one client may be used from different threads."""
from __future__ import annotations

import uuid
import warnings
from collections.abc import Sequence
from types import TracebackType
from typing import Any, Optional

from ._connection import Connection
from ._resume import Link
from ._state import SceneState
from .info import ServerInfo, SessionInfo
from .options import Options, Patience, Security
from .scene import Body
from .session import Session
from .v1 import session_pb2


def connect(address: str, *, security: Security = Security(), patience: Patience = Patience()) -> Client:
    """Connects to `HOST:PORT` or `unix:PATH`; InvalidArgument, which is a ValueError, for anything else, for example a URL.

    Unavailable, with the system's reason, when no daemon answers within `patience.call`, including a failed TLS handshake;
    Unauthenticated for an unknown token; InvalidArgument for unreadable files, and for a token that would be sent
    unencrypted.
    """
    connection = Connection(address, security, patience)
    connection.server_info()
    return Client(connection)


class Client:
    """Created by `connect()`. Its sessions share connections, which are opened as needed and closed with the last session
    or by `close()`."""

    def __init__(self, connection: Connection) -> None:
        """Internal: use `connect()`."""
        self._connection = connection

    def session(
        self,
        positions: Any,
        faces: Any,
        *,
        bodies: Sequence[Body] = (),
        excluded_pairs: Sequence[tuple[int, int]] = (),
        options: Options = Options(),
        id: str = "",
        first_frame: int = 0,
    ) -> Session:
        """Uploads a scene and its positions at the first frame.

        positions (n, 3) float32 or float64, finite, scene length unit: they travel and stay as they are, and those of every
        frame are alike; lists, and numbers of other types, become float64 where that holds them exactly. faces (m, 3)
        vertex indices of any integer type; a face may repeat one, and is the segment or point that it names. Vertices in no
        face are tested as points against faces, and against nothing else: a warning says how many there are. bodies: ranges that cover all vertices in order;
        none: all is deformable. excluded_pairs: of bodies by index, not tested against each other. id: a UUID, random when
        empty. first_frame: the number of these positions; the first step is the next.

        Unimplemented for vertices without any face, unless bodies are declared, to which faces may be added later.
        InvalidArgument for bad input, AlreadyExists for an id in use, ResourceExhausted beyond the daemon's limits.
        """
        state = SceneState(positions, faces, bodies, excluded_pairs)
        if alone := state.vertices_in_no_face():
            warnings.warn(f"vertices in no face: {alone} of {state.vertex_count}; they are tested as points against faces, and "
                          "against nothing else", stacklevel=2)
        header = session_pb2.SessionHeader(session_id=id or str(uuid.uuid4()), first_frame=first_frame)
        options.put_into(header.options)
        link = Link(self._connection, header, state)
        link.open()
        return Session(link)

    def server_info(self) -> ServerInfo:
        """Information about one daemon: behind a proxy, the one that answers."""
        return ServerInfo.read_from(self._connection.server_info())

    def list_sessions(self) -> list[SessionInfo]:
        """The sessions of this principal."""
        return [SessionInfo.read_from(session) for session in self._connection.list()]

    def get_session(self, id: str) -> SessionInfo:
        """NotFound for an unknown session. Keeps it from expiring, which `list_sessions()` does not."""
        return SessionInfo.read_from(self._connection.get(id))

    def delete_session(self, id: str) -> None:
        """NotFound for an unknown session."""
        self._connection.remove(id)

    def list_all_sessions(self) -> list[SessionInfo]:
        """The sessions of all principals. PermissionDenied without the admin role."""
        return [SessionInfo.read_from(owned.session, owned.principal) for owned in self._connection.list_all()]

    def delete_any_session(self, id: str, principal: Optional[str] = None) -> None:
        """As `delete_session()`, for any principal's session; FailedPrecondition if several principals use this id and
        `principal` does not select one. Needs the admin role."""
        self._connection.remove_any(id, principal)

    def close(self) -> None:
        """Closes the connections; open sessions fail."""
        self._connection.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, kind: Optional[type[BaseException]], error: Optional[BaseException],
                 trace: Optional[TracebackType]) -> None:
        self.close()
