# SPDX-License-Identifier: Apache-2.0
"""What a step cost. Plain values, safe to share between threads."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

FrontState = Literal["none", "built", "updated", "rebuilt", "capped"]


@dataclass(frozen=True)
class StageTimes:
    """Wall-clock milliseconds in the engine; see proto/warmfront/v1/step.proto."""

    total: float
    refit: float
    front: float
    elementary: float
    adjacent: float


@dataclass(frozen=True)
class StepCounts:
    """Counts of a step, explained in proto/warmfront/v1/step.proto, with those that are the same in every run."""

    bv_tests: int
    front_pairs: int
    front_bytes: int
    front_sprouted: int
    front_pruned: int
    front_skipped: int
    front_rested: int
    triangle_pairs: int
    adjacent_pairs: int
    cone_culled_pairs: int
    cone_patches: int
    elementary_tests: int
    orphan_tests: int
    primitive_tests: int
    coplanarity_passed: int
    exact_tests: int
    contacts_kept: int
    vertices_moved: int
    nodes_refit: int
    parts_moved: int
    near_parts: int
    parts_apart: int
    part_pairs_excluded: int
    parts: int
    parts_rigid: int
    triangle_pairs_filtered: int
    feature_pairs_filtered: int


@dataclass(frozen=True)
class Statistics:
    """Cost of a step, and savings of the scene's model."""

    ms: StageTimes
    counts: StepCounts
    front_state: FrontState


@dataclass(frozen=True)
class AllDeformable:
    """Cost of the same step with everything deformable; bytes of its frame as sent, and of all positions."""

    statistics: Statistics
    frame_bytes: int
    positions_bytes: int


_COUNTS = tuple(StepCounts.__dataclass_fields__)
_TIMES = tuple(StageTimes.__dataclass_fields__)
_STATES: tuple[FrontState, ...] = ("none", "none", "built", "updated", "rebuilt", "capped")


def statistics_of(message: Any) -> Statistics:
    """Of a v1.StepStatistics, or of an _engine.StepStatistics."""
    # Not by their constructors, which take ten times as long because they are frozen.
    ms, counts = object.__new__(StageTimes), object.__new__(StepCounts)
    if hasattr(message, "fill"):
        message.fill(ms.__dict__, counts.__dict__)
    else:
        ms.__dict__.update({name: getattr(message.ms, name) for name in _TIMES})
        counts.__dict__.update({name: getattr(message.counts, name) for name in _COUNTS})
    return Statistics(ms, counts, _STATES[message.front_state])
