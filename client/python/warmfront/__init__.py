# SPDX-License-Identifier: Apache-2.0
"""Warmfront from Python: continuous collision detection in this process and as a service, numpy in and out.

    import warmfront

    with warmfront.open(V0, F) as session:  # in this process; server="HOST:PORT": behind the daemon there, the same answers
        for V in frames:
            contacts = session.step(V)      # on the linear motion from the last frame to this one
            use(contacts.kind, contacts.v, contacts.toi)
        session.trial(V)                    # what would it meet? How far may it go?
        session.commit(0.9 * float(session.max_step(V)))

V0, V (n, 3) float32 or float64, F (m, 3) integers. `Collider` is a session in this process, `connect()` a client of a daemon
with sessions, `open()` either. A session survives a daemon that dies: it is created again from what was answered last, with
exactly one answer to each frame and the same bits. Errors are `WarmfrontError`s, one class a
canonical code (`NotFoundError`, ...; the names without "Error" are the same). Clients and sessions may be used by any thread.
"""
from . import _instructions

__path__ = _instructions.folders(list(__path__))  # before the engine is imported

from ._batch_contacts import BatchContacts
from ._contact_hash import contacts_hash
from ._continuity import Continuity, continuity
from ._screw import screw_way
from ._statistics import AllDeformable, StageTimes, Statistics, StepCounts
from ._stencils import RowsByVertex, Stencil, Stencils, rows_by_vertex
from .answer import Closest, Committed, Contact, Contacts, Intersections, Kind, MaxStep, Status, VertexDistances
from .batch import Batch
from .client import Client, connect
from .collider import Collider, has_engine, open as open, open_batch  # open: not by *, which would hide Python's own
from .errors import (
    Aborted, AbortedError, AlreadyExists, AlreadyExistsError, Cancelled, CancelledError, Code, DataLoss,
    DataLossError, DeadlineExceeded, DeadlineExceededError, FailedPrecondition, FailedPreconditionError,
    Internal, InternalError, InvalidArgument, InvalidArgumentError, NotFound, NotFoundError,
    PermissionDenied, PermissionDeniedError, ResourceExhausted, ResourceExhaustedError, Unauthenticated,
    UnauthenticatedError, Unavailable, UnavailableError, Unimplemented, UnimplementedError,
    WarmfrontError,
)
from .info import FiltersInfo, Limits, PrincipalUse, ServerInfo, SessionInfo
from .options import Options, Patience, Security, Timeouts
from .scene import Body, PairFilters
from .session import AnySession, Session

__all__ = [
    "Aborted", "AbortedError", "AllDeformable", "AnySession", "AlreadyExists", "AlreadyExistsError", "Batch", "BatchContacts", "Body",
    "Cancelled", "CancelledError", "Client", "Closest", "Code", "Collider", "Committed", "connect", "Contact", "Contacts",
    "contacts_hash", "Continuity", "continuity",
    "DataLoss", "DataLossError", "DeadlineExceeded", "DeadlineExceededError", "FailedPrecondition",
    "FailedPreconditionError", "FiltersInfo", "has_engine", "Internal", "InternalError", "Intersections", "InvalidArgument", "InvalidArgumentError",
    "Kind", "Limits", "MaxStep", "NotFound", "NotFoundError", "open_batch", "Options", "PairFilters", "Patience", "PermissionDenied",
    "PermissionDeniedError", "PrincipalUse", "ResourceExhausted", "ResourceExhaustedError", "RowsByVertex",
    "rows_by_vertex", "screw_way", "Security", "ServerInfo", "Session", "SessionInfo", "StageTimes", "Statistics", "Status", "Stencil",
    "Stencils", "StepCounts",
    "Timeouts", "Unauthenticated", "UnauthenticatedError", "Unavailable", "UnavailableError",
    "Unimplemented", "UnimplementedError", "VertexDistances", "WarmfrontError",
]
