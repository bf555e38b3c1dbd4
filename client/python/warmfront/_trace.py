# SPDX-License-Identifier: Apache-2.0
"""The caller's span, for traces that daemons export."""
from __future__ import annotations

import re

from .errors import InvalidArgumentError

_FIELDS = "-(?!0{32})[0-9a-f]{32}-(?!0{16})[0-9a-f]{16}-[0-9a-f]{2}"
# A later version begins as 00 does, and may have more behind it.
_TRACEPARENT = re.compile(f"00{_FIELDS}|(?!00|ff)[0-9a-f]{{2}}{_FIELDS}(-[!-~]*)?")


def traceparent_of(traceparent: str) -> str:
    """A traceparent of W3C Trace Context as it is, of version 00 or a later one; "" for none. InvalidArgumentError for anything else."""
    if not isinstance(traceparent, str) or (traceparent and not _TRACEPARENT.fullmatch(traceparent)):
        raise InvalidArgumentError(f"traceparent {traceparent!r}: 00-TRACE-SPAN-FLAGS of W3C Trace Context is expected, 32, 16 and 2 "
                                   "lower-case hexadecimal digits, no id of zeros alone")
    return traceparent
