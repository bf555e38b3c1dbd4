# SPDX-License-Identifier: Apache-2.0
"""Options of a session's collider, and of the connection. Plain values."""
from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, fields as fields_of
from typing import Any, Literal, Optional

from .errors import InvalidArgumentError

Tier = Literal["fast", "certified", "exact"]
Report = Literal["all", "earliest", "count", "candidates", "any", "vertex-distances"]
FrontMode = Literal["none", "paper", "warm"]
BoundsKind = Literal["aabb", "kdop18", "auto"]
ContactField = Literal["weights", "normal", "points", "direction", "squared_distance", "closest"]

# The wire's enums list these names in this order, after UNSPECIFIED.
_CHOICES: dict[str, tuple[str, ...]] = {
    "tier": ("fast", "certified", "exact"),
    "report": ("all", "earliest", "count", "candidates", "any", "vertex-distances"),
    "front": ("none", "paper", "warm"),
    "bounds": ("aabb", "kdop18", "auto"),
}
_FIELDS = ("weights", "normal", "points", "direction", "squared_distance", "closest")


@dataclass(frozen=True)
class Options:
    """Of a session. None takes the default, stated here; `Session.info()` returns the values in force.

    tier: "fast" may miss and may invent contacts; "certified" (default) never misses, and may report pairs within
        tolerance; "exact" is right.
    tolerance: relative to each query's own size, in (0, 1]. Default 1e-6.
    min_separation: report pairs that come within this distance, in the scene's length unit; >= 0, 0 in the fast tier,
        which decides touching; the exact tier reports these and no others. Default 0.
    report: "all" contacts (default), only those of the "earliest" time of the step, only the "count", or "candidates":
        every pair whose moving bounds overlap, untested (status BUDGET; toi is when they first do). With a
        min_separation, pairs nearer than it at a step's start have time 0, and "earliest" reports only these. "any" is of
        `Session.intersections()` alone, "vertex-distances" of `Session.vertex_distances()`.
    front, bounds, normal_cones, lazy_front, leaf_size, rebuild_after_stalled_steps, rebuild_every_steps,
        max_front_bytes: speed and memory only; the contacts are the same. See proto/warmfront/v1/options.proto.
    find_bodies, find_rigid, separate_parts: what the engine finds by itself, on unless False; the contacts are the same.
    explain: step an all-deformable scene beside: `Contacts.all_deformable` tells what the scene's model saves.
    max_contacts: a step with more fails with ResourceExhaustedError.
    fields: what else to tell of a contact, see `Contacts`; what is not asked for is neither computed nor sent. "normal" is
        the face's or both edges' own, "direction" that between the closest points.
    """

    tier: Optional[Tier] = None
    tolerance: Optional[float] = None
    min_separation: Optional[float] = None
    report: Optional[Report] = None
    front: Optional[FrontMode] = None
    bounds: Optional[BoundsKind] = None
    normal_cones: Optional[bool] = None
    lazy_front: Optional[bool] = None
    leaf_size: Optional[int] = None
    rebuild_after_stalled_steps: Optional[int] = None
    rebuild_every_steps: Optional[int] = None
    max_front_bytes: Optional[int] = None
    max_contacts: Optional[int] = None
    find_bodies: Optional[bool] = None
    find_rigid: Optional[bool] = None
    separate_parts: Optional[bool] = None
    explain: Optional[bool] = None
    fields: Collection[ContactField] = ()

    def put_into(self, message: Any, where: str = "options.") -> None:
        """Into a v1.ColliderOptions, or what it shares with a v1.Question. Raises InvalidArgumentError, naming the option
        behind `where`, for a word or type that the contract does not have."""
        for option in fields_of(self):
            name, value = option.name, getattr(self, option.name)
            if name == "fields":
                try:
                    given = [value] if isinstance(value, str) else list(value)
                except TypeError:
                    raise InvalidArgumentError(f"{where}fields: {value!r}; give a list of {', '.join(_FIELDS)}") from None
                for wanted in given:
                    if wanted not in _FIELDS:
                        raise InvalidArgumentError(f"{where}fields: '{wanted}' is none of {', '.join(_FIELDS)}")
                    setattr(message.fields, wanted, True)
            elif value is None:
                continue
            elif name in _CHOICES:
                if value not in _CHOICES[name]:
                    raise InvalidArgumentError(f"{where}{name}: '{value}' is none of {', '.join(_CHOICES[name])}")
                setattr(message, name, _CHOICES[name].index(value) + 1)
            else:
                try:
                    setattr(message, name, value)
                except (TypeError, ValueError):
                    raise InvalidArgumentError(f"{where}{name}: {value!r} is not a number that the contract takes") from None

    @staticmethod
    def read_from(message: Any) -> Options:
        """The values in force, from a v1.ColliderOptions."""
        values: dict[str, Any] = {}
        for option in fields_of(Options):
            value = getattr(message, option.name)
            if option.name == "fields":
                value = tuple(name for name in _FIELDS if getattr(value, name))
            elif option.name in _CHOICES:
                value = _CHOICES[option.name][value - 1] if value else None
            values[option.name] = value
        return Options(**values)


@dataclass(frozen=True)
class Security:
    """How to authenticate the daemon and the client. Files are PEM and read when the client connects.

    tls: encrypt; implied by any of the next three.
    ca_file: CA of the daemon's certificate; empty: gRPC's default CAs.
    cert_file, key_file: the client's certificate and key, for daemons that require them.
    server_name: expected in the daemon's certificate; empty: the address's host.
    token_file: contains only the token to send. Without TLS only to this machine.
    """

    tls: bool = False
    ca_file: str = ""
    cert_file: str = ""
    key_file: str = ""
    server_name: str = ""
    token_file: str = ""


@dataclass(frozen=True)
class Timeouts:
    """How long to wait for what, in seconds, all positive, and how often to try.

    call: connecting, and small calls. create: uploading and building a scene. answer: one frame; then the session is
    resumed. resume: finding a daemon again after losing it; then the session has ended, also where a daemon comes back later.
    A new session waits for a daemon for as long, too.
    resumes_without_answer: a session fails after this many consecutive resumes without an answer, so that a frame that
    crashes every daemon is not sent forever.
    """

    call: float = 10
    create: float = 300
    answer: float = 300
    resume: float = 60
    resumes_without_answer: int = 5

    def __post_init__(self) -> None:
        for name in ("call", "create", "answer", "resume"):
            if not getattr(self, name) > 0:
                raise InvalidArgumentError(f"timeouts.{name}: {getattr(self, name)} seconds; give a positive time")
        if self.resumes_without_answer < 0:
            raise InvalidArgumentError(f"timeouts.resumes_without_answer: {self.resumes_without_answer} is below 0")


# Its name before, for programs that were written then.
Patience = Timeouts


def check_options(options: Options) -> None:
    """InvalidArgumentError for what is no `Options`."""
    if not isinstance(options, Options):
        raise InvalidArgumentError(f"options: a {type(options).__name__}; give warmfront.Options(tier=..., ...)")
