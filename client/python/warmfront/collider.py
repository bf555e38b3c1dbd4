# SPDX-License-Identifier: Apache-2.0
"""A session in this process, and a session wherever it is to be. Thread-safe, as `AnySession` says."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Optional, Union

import numpy as np

from ._state import SceneState
from ._copies import Copies
from .batch import Batch
from .client import connect
from .errors import InvalidArgumentError, UnimplementedError
from .options import Options, Security, Timeouts
from .scene import Body, PairFilters, filters_of
from .session import AnySession, Session


class Collider(AnySession):
    """A session in this process: no daemon, no connection, no copy of what is given or told.

        import warmfront

        collider = warmfront.Collider(V0, F)
        for V in frames:
            contacts = collider.step(V)
            use(contacts.kind, contacts.v, contacts.toi)

    It answers every question that a session behind a daemon does, with the same names, types, errors and bits; what it lacks
    is another process to survive. The interpreter's lock is released while the engine computes, so that other threads go on;
    arrays that are given are looked at meanwhile, and have to stay as they are until the call returns. Columns of an answer
    are read-only views of memory that is the answer's own, for as long as any of them is kept.

    A KeyboardInterrupt stops what is computed: it does not count, and the session is where it was. One that comes when the
    answer is there already, and is about to be returned, may lose that answer: `last_frame` says whether the frame counted.
    Where there is no memory, ResourceExhaustedError is raised, and everything is as before. Not to be used on both sides of an
    os.fork(): of its threads, only the caller's is on the other side.
    """

    def __init__(
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
        threads: int = 0,
    ) -> None:
        """Takes a scene and its positions at the first frame; everything as in `Client.session()`.

        positions (n, 3) float32 or float64, finite, scene length unit: so are those of every frame. faces (m, 3) vertex indices
        of any integer type; None: none. edges (k, 2) of two different vertices each: hair and rods. bodies: ranges that cover
        all vertices in order; none: all is deformable. excluded_pairs: of bodies by index, not tested against each other.
        filters: pairs of features that do not count. thickness: (n), of each vertex, or one number for all, scene length
        unit. id: a UUID, random when empty. first_frame: the number of these positions; the first step is the next.

        threads: most that compute a question, 1 or more; 0: one for each core. Answers are the same bits for any number.

        InvalidArgumentError for bad input. UnimplementedError where this package has no engine: see `open()`.
        """
        local = _local()
        count = _threads_of(threads)
        state = SceneState(positions, faces, bodies, excluded_pairs, filters_of(filters), thickness, edges)
        super().__init__(local.Local(state, options, id, first_frame, count))


def has_engine() -> bool:
    """Whether this package can compute in this process, as `Collider` does: the client alone, for other systems, cannot."""
    try:
        _local()
    except UnimplementedError:
        return False
    return True


def _local() -> Any:
    try:
        from . import _local
    except ImportError as error:
        if error.name != "warmfront._engine" and "_engine" not in str(error):
            raise
        raise UnimplementedError(f"this package has no engine for this system ({error}); give a server, \"local\" or "
                                 "\"HOST:PORT\", or install the package that has one") from None
    return _local


def open(
    positions: Any,
    faces: Any = None,
    *,
    server: Optional[str] = None,
    edges: Any = None,
    bodies: Sequence[Body] = (),
    excluded_pairs: Sequence[tuple[int, int]] = (),
    filters: Union[PairFilters, Mapping[str, Any], None] = None,
    thickness: Any = None,
    options: Options = Options(),
    id: str = "",
    first_frame: int = 0,
    threads: Optional[int] = None,
    security: Security = Security(),
    timeouts: Timeouts = Timeouts(),
    traceparent: str = "",
) -> AnySession:
    """A session wherever it is to be: the same program runs in this process and on a server.

    server: None: in this process, a `Collider`; "local": a `Session` behind a daemon of this process's own; "HOST:PORT" or
    "unix:PATH": a `Session` behind the daemon there. threads: of the first two, most that compute a question; None: one for
    each core. security, timeouts, traceparent: of the connection, see `connect()`. Everything else as in `Client.session()`.

    `close()`, or `with`, ends the session, its connection, and the daemon that was started for it. Errors as those of `Collider`, `connect()`
    and `Client.session()`.
    """
    scene: dict[str, Any] = dict(edges=edges, bodies=bodies, excluded_pairs=excluded_pairs, filters=filters, thickness=thickness,
                                 options=options, id=id, first_frame=first_frame)
    if server is None:
        _check_no_connection(security, timeouts, traceparent)
        return Collider(positions, faces, threads=0 if threads is None else threads, **scene)
    if server == "local":
        count = 0 if threads is None else _threads_of(threads)
        flags = ["--threads", str(count)] if count else []
        client = connect(security=security, timeouts=timeouts, flags=flags, traceparent=traceparent)
    else:
        if threads is not None:
            raise InvalidArgumentError("threads: how many a daemon has is its own to say; leave it out")
        client = connect(server, security=security, timeouts=timeouts, traceparent=traceparent)
    try:
        session: Session = client.session(positions, faces, **scene)
    except BaseException:
        client.close()
        raise
    session._backend.ends_connection = True
    return session


def open_batch(
    count: int,
    positions: Any,
    faces: Any = None,
    *,
    server: Optional[str] = None,
    edges: Any = None,
    bodies: Sequence[Body] = (),
    excluded_pairs: Sequence[tuple[int, int]] = (),
    shared: Sequence[tuple[Body, Any, Any]] = (),
    filters: Union[PairFilters, Mapping[str, Any], None] = None,
    thickness: Any = None,
    options: Options = Options(),
    id: str = "",
    threads: Optional[int] = None,
    security: Security = Security(),
    timeouts: Timeouts = Timeouts(),
) -> Batch:
    """`count` copies of one scene that know nothing of each other, as `Client.batch()` says, wherever `open()` has them."""
    copies = Copies(count, positions, faces, edges, bodies, shared)
    return Batch(open(copies.positions(), copies.faces(), server=server, edges=copies.edges(), bodies=copies.all_bodies(),
                      excluded_pairs=copies.excluded(excluded_pairs), filters=copies.filters(filters),
                      thickness=copies.thickness(thickness), options=options, id=id, threads=threads, security=security,
                      timeouts=timeouts), copies)


def _threads_of(threads: Any) -> int:
    if isinstance(threads, bool) or not isinstance(threads, (int, np.integer)) or not 0 <= threads <= 1024:
        raise InvalidArgumentError(f"threads: {threads!r} is not in [0, 1024]; give how many may compute a question at once, or 0 for "
                                   "one for each core")
    return int(threads)


def _check_no_connection(security: Security, timeouts: Timeouts, traceparent: str) -> None:
    """What a connection has is of no use in this process: whoever gives it expects one."""
    for name, given in (("security", security != Security()), ("timeouts", timeouts != Timeouts()),
                        ("traceparent", traceparent != "")):
        if given:
            raise InvalidArgumentError(f"{name}: it is of a connection, and without a server there is none; give a server, or leave "
                                       "it out")
