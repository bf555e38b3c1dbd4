# SPDX-License-Identifier: Apache-2.0
"""All errors as a small tree of exceptions: one class per canonical code, all of them `WarmfrontError`.

The message says what is wrong, where (field, index) and what to do, whether this package or the daemon found it.
"""
from __future__ import annotations

import copy
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

    def said_with(self, before: str, after: str) -> WarmfrontError:
        """The same error, in more words."""
        other = copy.copy(self)
        other.message = before + self.message + after
        other.args = (other.message,)
        return other


class InvalidArgumentError(WarmfrontError, ValueError):
    """The input itself is bad; the message names the field and the first offender."""

    code = Code.INVALID_ARGUMENT


class FailedPreconditionError(WarmfrontError):
    """The input is valid, but not allowed in the present state."""

    code = Code.FAILED_PRECONDITION


class ResourceExhaustedError(WarmfrontError):
    """A stated limit was met."""

    code = Code.RESOURCE_EXHAUSTED


class UnimplementedError(WarmfrontError):
    """The daemon does not have this feature."""

    code = Code.UNIMPLEMENTED


class CancelledError(WarmfrontError):
    """Cancelled by the caller."""

    code = Code.CANCELLED


class InternalError(WarmfrontError):
    """An invariant was violated, or a message is not one of the contract."""

    code = Code.INTERNAL


class DataLossError(WarmfrontError):
    """The session's data in the daemon is corrupt and cannot be rebuilt."""

    code = Code.DATA_LOSS


class NotFoundError(WarmfrontError):
    """No such session."""

    code = Code.NOT_FOUND


class AlreadyExistsError(WarmfrontError):
    """The session's id is taken."""

    code = Code.ALREADY_EXISTS


class AbortedError(WarmfrontError):
    """Another client holds the session, or changed it."""

    code = Code.ABORTED


class DeadlineExceededError(WarmfrontError, TimeoutError):
    """Not done within its time limit."""

    code = Code.DEADLINE_EXCEEDED


class UnauthenticatedError(WarmfrontError):
    """The caller is unknown: no valid token or certificate."""

    code = Code.UNAUTHENTICATED


class PermissionDeniedError(WarmfrontError):
    """The caller is known, and lacks the permission."""

    code = Code.PERMISSION_DENIED


class UnavailableError(WarmfrontError, ConnectionError):
    """The daemon cannot be reached, or is about to stop; trying again may help."""

    code = Code.UNAVAILABLE


_CLASSES: dict[int, type[WarmfrontError]] = {
    cls.code: cls
    for cls in (InvalidArgumentError, FailedPreconditionError, ResourceExhaustedError, UnimplementedError, CancelledError,
                DataLossError, NotFoundError, AlreadyExistsError, AbortedError, DeadlineExceededError, UnauthenticatedError,
                PermissionDeniedError, UnavailableError)
}
_CLASSES[Code.OUT_OF_RANGE] = InvalidArgumentError

# Their former names, for programs that use them.
Aborted = AbortedError
AlreadyExists = AlreadyExistsError
Cancelled = CancelledError
DataLoss = DataLossError
DeadlineExceeded = DeadlineExceededError
FailedPrecondition = FailedPreconditionError
Internal = InternalError
InvalidArgument = InvalidArgumentError
NotFound = NotFoundError
PermissionDenied = PermissionDeniedError
ResourceExhausted = ResourceExhaustedError
Unauthenticated = UnauthenticatedError
Unavailable = UnavailableError
Unimplemented = UnimplementedError


def class_of(code: int) -> type[WarmfrontError]:
    """The exception for a canonical code; `InternalError` for codes on which a caller cannot act."""
    return _CLASSES.get(code, InternalError)


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
    # gRPC's own: a connection that ends in the middle shows as any of these, and a stream that the daemon's gRPC reset for
    # want of transport memory as RESOURCE_EXHAUSTED.
    if not error.reason and isinstance(error, ResourceExhaustedError):
        return error.message.startswith("Received RST_STREAM")
    return not error.reason and isinstance(error, (UnavailableError, CancelledError, InternalError, DeadlineExceededError))
