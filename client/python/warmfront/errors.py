# SPDX-License-Identifier: Apache-2.0
"""What can go wrong, as a small tree of exceptions: one class a canonical code, all of them `WarmfrontError`.

The message says what is wrong, where (field, index) and what to do, whether this package found it or the daemon.
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

    reason: the daemon's `ErrorReason` without its prefix, such as "LIMIT"; empty where the error is not the daemon's.
    expected_frame: with reason FRAME_OUT_OF_ORDER, the frame number to send.
    limit: with reason LIMIT, the daemon's setting that was met, such as "max-total-bytes"; else empty.
    retry_after: seconds after which trying again may help, None where it cannot.
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
    """The input itself is bad; the message names the field and the first offender."""

    code = Code.INVALID_ARGUMENT


class FailedPrecondition(WarmfrontError):
    """The input is good, but not in this state."""

    code = Code.FAILED_PRECONDITION


class ResourceExhausted(WarmfrontError):
    """A stated limit was met."""

    code = Code.RESOURCE_EXHAUSTED


class Unimplemented(WarmfrontError):
    """The daemon does not have this feature."""

    code = Code.UNIMPLEMENTED


class Cancelled(WarmfrontError):
    """Someone asked to stop."""

    code = Code.CANCELLED


class Internal(WarmfrontError):
    """An invariant broke, or what arrived is no message of the contract."""

    code = Code.INTERNAL


class DataLoss(WarmfrontError):
    """What was kept is broken, and cannot be made anew from what is left."""

    code = Code.DATA_LOSS


class NotFound(WarmfrontError):
    """No such session."""

    code = Code.NOT_FOUND


class AlreadyExists(WarmfrontError):
    """The session's id is taken."""

    code = Code.ALREADY_EXISTS


class Aborted(WarmfrontError):
    """Someone else holds the session, or changed it."""

    code = Code.ABORTED


class DeadlineExceeded(WarmfrontError, TimeoutError):
    """Not done in the time stated."""

    code = Code.DEADLINE_EXCEEDED


class Unauthenticated(WarmfrontError):
    """It is not known who asks."""

    code = Code.UNAUTHENTICATED


class PermissionDenied(WarmfrontError):
    """It is known who asks, and they may not."""

    code = Code.PERMISSION_DENIED


class Unavailable(WarmfrontError, ConnectionError):
    """The daemon cannot be reached, or is about to stop; trying again may help."""

    code = Code.UNAVAILABLE


_CLASSES: dict[int, type[WarmfrontError]] = {
    cls.code: cls
    for cls in (InvalidArgument, FailedPrecondition, ResourceExhausted, Unimplemented, Cancelled, DataLoss, NotFound,
                AlreadyExists, Aborted, DeadlineExceeded, Unauthenticated, PermissionDenied, Unavailable)
}
_CLASSES[Code.OUT_OF_RANGE] = InvalidArgument


def class_of(code: int) -> type[WarmfrontError]:
    """The exception for a canonical code; `Internal` for those that say nothing of what to do."""
    return _CLASSES.get(code, Internal)


def lost_session(error: WarmfrontError) -> bool:
    """Whether the daemon has the session no more."""
    return error.reason in ("SESSION_NOT_FOUND", "DATA_LOSS")


def other_state(error: WarmfrontError) -> bool:
    """Whether the daemon has the session, but not in the state that this client knows."""
    return error.reason in ("FRAME_CHANGED", "STATE_CHANGED")


def may_resume(error: WarmfrontError) -> bool:
    """Whether the session may go on once it was resumed: creating it again, or trying again, may help."""
    if lost_session(error) or other_state(error) or error.retry_after is not None or error.reason == "DRAINING":
        return True
    # gRPC's own: a connection that ends in the middle shows as any of these.
    return not error.reason and isinstance(error, (Unavailable, Cancelled, Internal, DeadlineExceeded))
