# SPDX-License-Identifier: Apache-2.0
"""All errors as a small tree of exceptions: one class per canonical code, all of them `WarmfrontError`.

The message says what is wrong, where (field, index) and what to do, whether this package or the daemon found it.
"""
from __future__ import annotations

import enum
from typing import ClassVar, Optional


class Code(enum.IntEnum):
    """Canonical codes, by their numbers in gRPC."""

    CANCELLED = 1
    UNKNOWN = 2
    INVALID_ARGUMENT = 3
    DEADLINE_EXCEEDED = 4
    NOT_FOUND = 5
    ALREADY_EXISTS = 6
    PERMISSION_DENIED = 7
    RESOURCE_EXHAUSTED = 8
    FAILED_PRECONDITION = 9
    ABORTED = 10
    OUT_OF_RANGE = 11
    UNIMPLEMENTED = 12
    INTERNAL = 13
    UNAVAILABLE = 14
    DATA_LOSS = 15
    UNAUTHENTICATED = 16


class WarmfrontError(Exception):
    """Any error of this package; `code` says which kind.

    reason: the daemon's `ErrorReason` without its prefix, for example "LIMIT"; empty for errors of this package or gRPC.
    expected_frame: with reason FRAME_OUT_OF_ORDER, the frame number to send.
    limit: with reason LIMIT, the daemon's exceeded setting, for example "max-total-bytes"; else empty.
    retry_after: seconds after which a retry may help, None if it cannot.
    """

    code: ClassVar[Code] = Code.INTERNAL

    def __init__(
        self,
        message: str,
        *,
        reason: str = "",
        expected_frame: Optional[int] = None,
        limit: str = "",
        retry_after: Optional[float] = None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.reason = reason
        self.expected_frame = expected_frame
        self.limit = limit
        self.retry_after = retry_after


class InvalidArgument(WarmfrontError, ValueError):
    """The input is invalid; the message names the field and the first offender."""

    code = Code.INVALID_ARGUMENT


class FailedPrecondition(WarmfrontError):
    """The input is valid, but not in this state."""

    code = Code.FAILED_PRECONDITION


class ResourceExhausted(WarmfrontError):
    """A stated limit was exceeded."""

    code = Code.RESOURCE_EXHAUSTED


class Unimplemented(WarmfrontError):
    """The daemon lacks this feature."""

    code = Code.UNIMPLEMENTED


class Cancelled(WarmfrontError):
    """The call was cancelled."""

    code = Code.CANCELLED


class Internal(WarmfrontError):
    """An invariant does not hold, or a received message is invalid."""

    code = Code.INTERNAL


class DataLoss(WarmfrontError):
    """Stored data are broken and cannot be recomputed."""

    code = Code.DATA_LOSS


class NotFound(WarmfrontError):
    """No such session."""

    code = Code.NOT_FOUND


class AlreadyExists(WarmfrontError):
    """The session's id is in use."""

    code = Code.ALREADY_EXISTS


class Aborted(WarmfrontError):
    """Another client holds the session, or changed it."""

    code = Code.ABORTED


class DeadlineExceeded(WarmfrontError, TimeoutError):
    """Not done in the stated time."""

    code = Code.DEADLINE_EXCEEDED


class Unauthenticated(WarmfrontError):
    """The caller is not authenticated."""

    code = Code.UNAUTHENTICATED


class PermissionDenied(WarmfrontError):
    """The caller is authenticated, but not permitted."""

    code = Code.PERMISSION_DENIED


class Unavailable(WarmfrontError, ConnectionError):
    """The daemon is unreachable, or about to stop; a retry may help."""

    code = Code.UNAVAILABLE


_CLASSES: dict[int, type[WarmfrontError]] = {
    cls.code: cls
    for cls in (InvalidArgument, FailedPrecondition, ResourceExhausted, Unimplemented, Cancelled, DataLoss, NotFound,
                AlreadyExists, Aborted, DeadlineExceeded, Unauthenticated, PermissionDenied, Unavailable)
}
_CLASSES[Code.OUT_OF_RANGE] = InvalidArgument


def class_of(code: int) -> type[WarmfrontError]:
    """The exception for a canonical code; `Internal` for codes without a class."""
    return _CLASSES.get(code, Internal)


def lost_session(error: WarmfrontError) -> bool:
    """Does the daemon no longer have the session?"""
    return error.reason in ("SESSION_NOT_FOUND", "DATA_LOSS")


def other_state(error: WarmfrontError) -> bool:
    """Does the daemon have the session in another state than this client's?"""
    return error.reason in ("FRAME_CHANGED", "STATE_CHANGED")


def may_resume(error: WarmfrontError) -> bool:
    """Can a resume help: creating the session again, or retrying?"""
    if lost_session(error) or other_state(error) or error.retry_after is not None or error.reason == "DRAINING":
        return True
    # gRPC's own codes: an interrupted connection shows as any of these.
    return not error.reason and isinstance(error, (Unavailable, Cancelled, Internal, DeadlineExceeded))
