# SPDX-License-Identifier: Apache-2.0
"""A daemon's information about itself and its sessions. Plain values."""
from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timezone
from typing import Any

from .options import Options


@dataclass(frozen=True)
class Limits:
    """A daemon's limits; see proto/warmfront/v1/session.proto for each."""

    window: int
    max_message_bytes: int
    answer_chunk_bytes: int
    max_sessions: int
    max_sessions_per_principal: int
    max_principal_bytes: int
    max_streams_per_principal: int
    max_frames_per_principal: int
    max_uploads_per_principal: int
    max_vertices: int
    max_triangles: int
    max_contacts: int
    max_session_bytes: int
    max_total_bytes: int
    max_open_streams: int
    max_frames_in_flight: int
    max_queued_bytes: int
    idle_timeout_ms: int
    upload_timeout_ms: int
    write_stall_timeout_ms: int
    max_streams: int


@dataclass(frozen=True)
class PrincipalUse:
    """The caller's usage, to compare with the limits per principal. name: empty where callers are not authenticated.
    weight: its share of the cores relative to other waiting principals."""

    name: str
    sessions: int
    charged_bytes: int
    open_streams: int
    frames_in_flight: int
    weight: int


@dataclass(frozen=True)
class ServerInfo:
    """A daemon: its version, limits and load. charged_bytes: of max_total_bytes, held or reserved by its sessions.
    principal: the caller."""

    version: str
    limits: Limits
    threads: int
    sessions: int
    draining: bool
    uptime_ms: int
    charged_bytes: int
    open_streams: int
    frames_in_flight: int
    principal: PrincipalUse

    @staticmethod
    def read_from(message: Any) -> ServerInfo:
        """Of a v1.GetServerInfoResponse."""
        values = {name: getattr(message, name) for name in ServerInfo.__dataclass_fields__}
        values["limits"] = Limits(**{name: getattr(message.limits, name) for name in Limits.__dataclass_fields__})
        values["principal"] = PrincipalUse(**{name: getattr(message.principal, name) for name in PrincipalUse.__dataclass_fields__})
        return ServerInfo(**values)


@dataclass(frozen=True)
class FiltersInfo:
    """`PairFilters` in force, without their arrays; all 0 where none are. excluded_vertex_pairs: how many. patches: whether
    there are any."""

    within_edges: int
    near_at_rest: float
    excluded_vertex_pairs: int
    patches: bool


@dataclass(frozen=True)
class SessionInfo:
    """State of a session in the daemon.

    principal: the creator, for callers with the admin role; else empty. dtype: "float32" or "float64". options: the values
    in force. lone_edge_count: edges of no face, which are among the edge_count. filters: pairs that do not count.
    most_thickness: no vertex is thicker; 0 where nothing is. world_count: different worlds that bodies are in, 0 not counted.
    screw_count: bodies that move along screws. steps: computed since it was created there. memory_bytes: held in the daemon.
    attached: a stream is attached. idle: seconds since the last request about it, 0 during a request.
    """

    id: str
    principal: str
    vertex_count: int
    face_count: int
    edge_count: int
    lone_edge_count: int
    body_count: int
    dtype: str
    options: Options
    filters: FiltersInfo
    most_thickness: float
    world_count: int
    screw_count: int
    last_frame: int
    steps: int
    memory_bytes: int
    attached: bool
    created: datetime
    idle: float

    @staticmethod
    def read_from(message: Any, principal: str = "") -> SessionInfo:
        """Of a v1.SessionInfo."""
        same = ("vertex_count", "face_count", "edge_count", "lone_edge_count", "body_count", "last_frame", "steps", "memory_bytes", "attached",
                "most_thickness", "world_count", "screw_count")
        filters = message.filters
        return SessionInfo(
            id=message.session_id,
            principal=principal,
            dtype="float32" if message.dtype == 1 else "float64",
            options=Options.read_from(message.options),
            filters=FiltersInfo(filters.within_edges, filters.near_at_rest, filters.excluded_vertex_pair_count, filters.patches),
            created=datetime.fromtimestamp(message.created_unix_ms / 1000, timezone.utc),
            idle=message.idle_ms / 1000,
            **{name: getattr(message, name) for name in same},
        )
