# SPDX-License-Identifier: Apache-2.0
"""Changes of the scene that are larger than a message, cut into pieces."""
from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from .v1 import session_pb2

_ARRAYS = {"add": ("faces", "edges", "positions", "thickness"), "replace_body": ("faces", "edges", "positions", "thickness"),
           "replace_elements": ("faces", "edges"), "change_filters": ("rest_positions", "excluded_vertex_pairs", "patches")}


def _holder_of(change: session_pb2.SceneChange, kind: str) -> Any:
    """What has the arrays of a change of this kind."""
    inner = getattr(change, kind)
    return getattr(inner, "with") if kind == "replace_body" else inner


def pieces_of(request: session_pb2.ChangeSceneRequest, chunk: int) -> Iterator[session_pb2.ChangeSceneRequest]:
    """The messages of StreamChangeScene that are this request, none with more than about `chunk` bytes of arrays."""
    first = session_pb2.ChangeSceneRequest()
    first.CopyFrom(request)
    del first.changes[:]
    yield first
    for change in request.changes:
        kind = change.WhichOneof("what") or ""
        names = _ARRAYS.get(kind, ())
        head = session_pb2.ChangeSceneRequest(changes=[change])
        for name in names:
            _holder_of(head.changes[0], kind).ClearField(name)
        yield head
        for name in names:
            view = memoryview(getattr(_holder_of(change, kind), name))
            for at in range(0, len(view), chunk):
                piece = session_pb2.SceneChange(continues=True)
                holder = _holder_of(piece, kind)
                holder.SetInParent()
                setattr(holder, name, bytes(view[at:at + chunk]))
                yield session_pb2.ChangeSceneRequest(changes=[piece])
