# SPDX-License-Identifier: Apache-2.0
"""Where part of a motion along a screw ends: engine/screw.h, operation for operation, so that it gives the daemon's bits.
Pure functions; numbers are float64, and no library's sine, whose last bit differs from machine to machine.

A number is a float, or an array of one for each of many poses: the same operations have the same bits. `pose[i][k]` of a pose is
a number, and of many that of each: (3, 4, n)."""
from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Callable, Optional

import numpy as np
import numpy.typing as npt

from ._part_way import each_pose_part_way, pose_part_way
from .errors import InvalidArgumentError
from .scene import pose_of

Array = npt.NDArray[Any]
Poses = list[Optional[Array]]  # of bodies; None: where their positions are
Number = Any
Vector = tuple[Number, Number, Number]
_TERMS = 14
_MANY = 16  # of poses, from which on arrays take less time than each by itself
_TOLERANCE = 1e-5  # kPoseTolerance of engine/pose.h


def screw_way(start: Any, end: Any, fraction: float, dtype: Any = np.float64) -> npt.NDArray[np.float64]:
    """Where a body with `screw=True` is on its way from one pose to another: the pose (3, 4) that `commit(fraction)` leaves it
    at, to the bit, in float64.

    start, end: [R t] (3, 4), length unit of the scene, R a rotation: no entry of R^T R - I above 1e-5. fraction: in [0, 1].
    dtype: the session's; in one of float32 poses are rounded to it. InvalidArgumentError for anything else. Source: engine/screw.h."""
    if not 0 <= fraction <= 1:
        raise InvalidArgumentError(f"fraction: {fraction} is not in [0, 1]")
    given = np.dtype(dtype)
    if given not in (np.dtype("f4"), np.dtype("f8")):
        raise InvalidArgumentError(f"dtype: {given} is not the dtype of a session; float32 and float64 are")
    first, last = (_rigid_pose(pose, where, given) for pose, where in ((start, "start"), (end, "end")))
    return pose_along_screw(first, last, float(fraction), given)


def _rigid_pose(pose: Any, where: str, dtype: np.dtype[Any]) -> npt.NDArray[np.float64]:
    """Rounded to `dtype`. InvalidArgumentError for what is no rotation and a translation, as check_pose() of engine/pose.h has it."""
    matrix = pose_of(pose, where).astype(dtype).astype(np.float64)
    if not np.isfinite(matrix).all():
        at = int(np.argmin(np.isfinite(matrix).reshape(-1)))
        what = "not a number" if np.isnan(matrix.reshape(-1)[at]) else "infinite"
        raise InvalidArgumentError(f"{where}[{at}]: is {what}; a pose is a finite 3x4 matrix")
    rotation = matrix[:, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        products = rotation.T @ rotation
        off = ~(np.abs(products - np.eye(3)) <= _TOLERANCE)
        if off.any():
            a, b = (int(k) for k in np.argwhere(off)[0])
            raise InvalidArgumentError(f"{where}: is not rigid: columns {a} and {b} of its 3x3 part have the product {products[a, b]:f} "
                                       f"where {int(a == b)} is expected, give or take {_TOLERANCE:g}; give a rotation, made orthonormal "
                                       "again where it is a product of many")
    if not np.linalg.det(rotation) > 0:
        raise InvalidArgumentError(f"{where}: is not rigid: its 3x3 part mirrors; give a rotation")
    return matrix


def pose_along_screw(start: Array, end: Array, fraction: float, dtype: np.dtype[Any]) -> npt.NDArray[np.float64]:
    """The pose (3, 4) that is `fraction` of the way from one to the other, along the screw between them, rounded to `dtype`;
    `end` itself at fraction 1 and `start` itself at 0."""
    if fraction in (0, 1):
        return end if fraction == 1 else start
    squared, bend = _bend(start.tolist(), end.tolist(), fraction)
    if squared == 0:
        return pose_part_way(start, end, fraction, dtype)
    return _bent(pose_part_way(start, end, fraction, np.dtype("f8")), np.array(bend), dtype)


def poses_along_screws(starts: Array, ends: Array, fractions: Array, dtype: np.dtype[Any]) -> npt.NDArray[np.float64]:
    """The same of many poses (n, 3, 4), each at its own of `fractions` (n)."""
    with np.errstate(all="ignore"):  # of what does not turn, which is not used
        squared, bend = _bend(np.moveaxis(starts, 0, -1), np.moveaxis(ends, 0, -1), fractions)
    bent = _bent(each_pose_part_way(starts, ends, fractions, np.dtype("f8")), np.moveaxis(np.array(bend), -1, 0), dtype)
    turns = (squared != 0) & (fractions != 0) & (fractions != 1)
    return np.where(turns[:, None, None], bent, each_pose_part_way(starts, ends, fractions, dtype))


def commit_poses(starts: Sequence[Array], ends: Sequence[Array], screws: Sequence[bool], fraction: float,
                 dtype: np.dtype[Any]) -> Sequence[Array]:
    """Where a commit leaves rigid bodies (3, 4): those of `screws` along theirs, the others' numbers along lines."""
    if fraction == 1:
        return ends
    if len(ends) < _MANY:
        return [(pose_along_screw if screw else pose_part_way)(start, end, fraction, dtype)
                for start, end, screw in zip(starts, ends, screws)]
    first, last, share = np.array(starts), np.array(ends), np.full(len(ends), fraction)
    lines = each_pose_part_way(first, last, share, dtype)
    if not any(screws):
        return list(lines)
    return list(np.where(np.array(screws)[:, None, None], poses_along_screws(first, last, share, dtype), lines))


def _bent(line: Array, bend: Array, dtype: np.dtype[Any]) -> npt.NDArray[np.float64]:
    """What is on a line, and beside it by `bend`; where that is beyond float64, on the line. Rounded to `dtype`."""
    with np.errstate(over="ignore", invalid="ignore"):
        beside = line + bend
    bent: npt.NDArray[np.float64] = np.where(np.isfinite(beside), beside, line).astype(dtype).astype(np.float64)
    return bent


def _bend(start: Any, end: Any, fraction: Number) -> tuple[Number, list[list[Number]]]:
    """The square of the angle between two poses, and how far part of the screw is beside part of the line, (3, 4)."""
    angular, linear = _twist_between(start, end)
    squared = _squared(angular)
    of_bend, of_turn = _arc_shares(squared, fraction)
    columns = []
    for k in range(4):
        bend = _cross(angular, _cross(angular, _column(start, k)) if k < 3 else linear)
        turn = _cross(angular, bend)
        columns.append([of_bend * bend[row] + of_turn * turn[row] for row in range(3)])
    return squared, [list(row) for row in zip(*columns)]


def _twist_between(start: Any, end: Any) -> tuple[Vector, Vector]:
    """The angular velocity, and the linear one of the point that is at the translation of `start`."""
    begin, last = _column(start, 3), _column(end, 3)
    way = (last[0] - begin[0], last[1] - begin[1], last[2] - begin[2])
    real, imaginary = _quaternion(start, end)
    length = _root(_squared(imaginary))
    turns = length > 0
    angular = _chosen(turns, _scaled(2 * _angle(real, length) / _where(turns, length, 1.0), imaginary), (0.0, 0.0, 0.0))
    across = _cross(angular, way)
    back = _scaled(_cotangent_share(_squared(angular)), _cross(angular, across))
    return angular, _sum(_sum(way, _scaled(-0.5, across)), back)


def _quaternion(start: Any, end: Any) -> tuple[Number, Vector]:
    """Of the rotation between, of some length from 1 to 4."""
    a, b = end, start
    r = [(a[i][0] * b[j][0] + a[i][1] * b[j][1]) + a[i][2] * b[j][2] for i in range(3) for j in range(3)]
    ww = 1 + ((r[0] + r[4]) + r[8])
    xx = 1 + ((r[0] - r[4]) - r[8])
    yy = 1 + ((r[4] - r[0]) - r[8])
    zz = 1 + ((r[8] - r[0]) - r[4])
    q = _chosen((ww >= xx) & (ww >= yy) & (ww >= zz), (ww, r[7] - r[5], r[2] - r[6], r[3] - r[1]),
                _chosen((xx >= yy) & (xx >= zz), (r[7] - r[5], xx, r[1] + r[3], r[2] + r[6]),
                        _chosen(yy >= zz, (r[2] - r[6], r[1] + r[3], yy, r[5] + r[7]),
                                (r[3] - r[1], r[2] + r[6], r[5] + r[7], zz))))
    sign = _where(q[0] < 0, -1.0, 1.0)
    return sign * q[0], (sign * q[1], sign * q[2], sign * q[3])


def _angle(x: Number, y: Number) -> Number:
    t = y / (x + _root(x * x + y * y))
    for _ in range(2):
        t = t / (1 + _root(1 + t * t))
    square = t * t
    series = 0.0
    for k in range(15, -1, -1):
        series = 1.0 / (2 * k + 1) - square * series
    return 8 * (t * series)


def _alternating(z: Number, first: float, ratio: Callable[[int], float]) -> Number:
    series = 1.0
    for k in range(_TERMS, 0, -1):
        series = 1 - (z * ratio(k)) * series
    return first * series


def _versine(z: Number) -> Number:
    return _alternating(z, 0.5, lambda k: 1.0 / ((2 * k + 1) * (2 * k + 2)))


def _lag(z: Number) -> Number:
    return _alternating(z, 1.0 / 6, lambda k: 1.0 / ((2 * k + 2) * (2 * k + 3)))


def _cotangent_share(z: Number) -> Number:
    series = _alternating(z, 1.0 / 12, lambda k: (k + 1.0) / (k * (2.0 * k + 3) * (2.0 * k + 4)))
    return series / (2 * _versine(z))


def _arc_shares(squared: Number, s: Number) -> tuple[Number, Number]:
    square = s * s
    return (square * _versine(squared * square) - s * _versine(squared),
            (square * s) * _lag(squared * square) - s * _lag(squared))


def _column(pose: Any, k: int) -> Vector:
    return pose[0][k], pose[1][k], pose[2][k]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _scaled(s: Number, a: Vector) -> Vector:
    return s * a[0], s * a[1], s * a[2]


def _squared(a: Vector) -> Number:
    return a[0] * a[0] + a[1] * a[1] + a[2] * a[2]


def _root(x: Number) -> Number:
    return np.sqrt(x) if isinstance(x, np.ndarray) else math.sqrt(x)


def _where(holds: Any, then: Number, otherwise: Number) -> Number:
    if isinstance(holds, np.ndarray):
        return np.where(holds, then, otherwise)
    return then if holds else otherwise


def _chosen(holds: Any, then: tuple[Number, ...], otherwise: tuple[Number, ...]) -> Any:
    if isinstance(holds, np.ndarray):
        return tuple(np.where(holds, a, b) for a, b in zip(then, otherwise))
    return then if holds else otherwise
