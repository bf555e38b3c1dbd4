# SPDX-License-Identifier: Apache-2.0
"""Warmfront from Python: continuous collision detection as a service, numpy in and out.

    import warmfront

    with warmfront.connect("127.0.0.1:50051").session(V0, F) as session:
        for V in frames:
            contacts = session.step(V)      # on the linear motion from the last frame to this one
            use(contacts.kind, contacts.v, contacts.toi)

V0, V (n, 3) float32 or float64, F (m, 3) integers. A session survives a daemon that dies: it is created again from the
last answered state, with exactly one answer to each frame and the same bits. Errors are `WarmfrontError`s, one class per
canonical code. A Client is thread-safe, a Session is used by one thread at a time.
"""
from .answer import AllDeformable, Contacts, Kind, StageTimes, Statistics, Status, StepCounts
from .client import Client, connect
from .errors import (
    Aborted,
    AlreadyExists,
    Cancelled,
    Code,
    DataLoss,
    DeadlineExceeded,
    FailedPrecondition,
    Internal,
    InvalidArgument,
    NotFound,
    PermissionDenied,
    ResourceExhausted,
    Unauthenticated,
    Unavailable,
    Unimplemented,
    WarmfrontError,
)
from .info import Limits, PrincipalUse, ServerInfo, SessionInfo
from .options import Options, Patience, Security
from .scene import Body
from .session import Session

__all__ = [
    "Aborted", "AllDeformable", "AlreadyExists", "Body", "Cancelled", "Client", "Code", "Contacts", "DataLoss",
    "DeadlineExceeded", "FailedPrecondition", "Internal", "InvalidArgument", "Kind", "Limits", "NotFound", "Options", "Patience",
    "PermissionDenied", "PrincipalUse", "ResourceExhausted", "Security", "ServerInfo", "Session", "SessionInfo", "StageTimes", "Statistics",
    "Status", "StepCounts", "Unauthenticated", "Unavailable", "Unimplemented", "WarmfrontError", "connect",
]
