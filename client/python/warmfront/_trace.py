# SPDX-License-Identifier: Apache-2.0
"""The caller's span, for traces that daemons export."""
from __future__ import annotations

import re

from .errors import InvalidArgumentError

_TRACEPARENT = re.compile(r"00-(?!0{32})[0-9a-f]{32}-(?!0{16})[0-9a-f]{16}-[0-9a-f]{2}")


def traceparent_of(traceparent: str) -> str:
    """A traceparent of W3C Trace Context, version 00, as it is; "" for none. InvalidArgumentError for anything else."""
    if not isinstance(traceparent, str) or (traceparent and not _TRACEPARENT.fullmatch(traceparent)):
        raise InvalidArgumentError(f"traceparent {traceparent!r}: 00-TRACE-SPAN-FLAGS of W3C Trace Context is expected, 32, 16 and 2 "
                                   "lower-case hexadecimal digits, no id of zeros alone")
    return traceparent
