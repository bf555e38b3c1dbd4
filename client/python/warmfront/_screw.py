# SPDX-License-Identifier: Apache-2.0
"""Where part of a motion along a screw ends: engine/screw.h, operation for operation, so that it gives the daemon's bits.
Pure functions; numbers are float64, and no library's sine, whose last bit differs from machine to machine."""
from __future__ import annotations

import math
from typing import Any, Callable

import numpy as np
import numpy.typing as npt

from ._part_way import pose_part_way
from .errors import InvalidArgumentError
from .scene import pose_of

Array = npt.NDArray[Any]
Vector = tuple[float, float, float]
_TERMS = 14
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
    angular, linear = twist_between(start, end)
    squared = _squared(angular)
    if squared == 0:
        return pose_part_way(start, end, fraction, dtype)
    of_bend, of_turn = _arc_shares(squared, fraction)
    pose = pose_part_way(start, end, fraction, np.dtype("f8")).copy()
    for k in range(4):
        bend = _cross(angular, _cross(angular, _column(start, k)) if k < 3 else linear)
        turn = _cross(angular, bend)
        for row in range(3):
            bent = float(pose[row, k]) + (of_bend * bend[row] + of_turn * turn[row])
            if math.isfinite(bent):
                pose[row, k] = bent
    rounded: npt.NDArray[np.float64] = pose.astype(dtype).astype(np.float64)
    return rounded


def twist_between(start: Array, end: Array) -> tuple[Vector, Vector]:
    """The angular velocity, and the linear one of the point that is at the translation of `start`."""
    begin = _column(start, 3)
    way = (float(end[0, 3]) - begin[0], float(end[1, 3]) - begin[1], float(end[2, 3]) - begin[2])
    real, imaginary = _quaternion(start, end)
    length = math.sqrt(_squared(imaginary))
    if not length > 0:
        return (0.0, 0.0, 0.0), way
    angular = _scaled(2 * _angle(real, length) / length, imaginary)
    across = _cross(angular, way)
    back = _scaled(_cotangent_share(_squared(angular)), _cross(angular, across))
    return angular, _sum(_sum(way, _scaled(-0.5, across)), back)


def _quaternion(start: Array, end: Array) -> tuple[float, Vector]:
    """Of the rotation between, of some length from 1 to 4."""
    a, b = end.tolist(), start.tolist()
    r = [(a[i][0] * b[j][0] + a[i][1] * b[j][1]) + a[i][2] * b[j][2] for i in range(3) for j in range(3)]
    ww = 1 + ((r[0] + r[4]) + r[8])
    xx = 1 + ((r[0] - r[4]) - r[8])
    yy = 1 + ((r[4] - r[0]) - r[8])
    zz = 1 + ((r[8] - r[0]) - r[4])
    if ww >= xx and ww >= yy and ww >= zz:
        q = (ww, r[7] - r[5], r[2] - r[6], r[3] - r[1])
    elif xx >= yy and xx >= zz:
        q = (r[7] - r[5], xx, r[1] + r[3], r[2] + r[6])
    elif yy >= zz:
        q = (r[2] - r[6], r[1] + r[3], yy, r[5] + r[7])
    else:
        q = (r[3] - r[1], r[2] + r[6], r[5] + r[7], zz)
    sign = -1.0 if q[0] < 0 else 1.0
    return sign * q[0], (sign * q[1], sign * q[2], sign * q[3])


def _angle(x: float, y: float) -> float:
    t = y / (x + math.sqrt(x * x + y * y))
    for _ in range(2):
        t = t / (1 + math.sqrt(1 + t * t))
    square = t * t
    series = 0.0
    for k in range(15, -1, -1):
        series = 1.0 / (2 * k + 1) - square * series
    return 8 * (t * series)


def _alternating(z: float, first: float, ratio: Callable[[int], float]) -> float:
    series = 1.0
    for k in range(_TERMS, 0, -1):
        series = 1 - (z * ratio(k)) * series
    return first * series


def _versine(z: float) -> float:
    return _alternating(z, 0.5, lambda k: 1.0 / ((2 * k + 1) * (2 * k + 2)))


def _lag(z: float) -> float:
    return _alternating(z, 1.0 / 6, lambda k: 1.0 / ((2 * k + 2) * (2 * k + 3)))


def _cotangent_share(z: float) -> float:
    series = _alternating(z, 1.0 / 12, lambda k: (k + 1.0) / (k * (2.0 * k + 3) * (2.0 * k + 4)))
    return series / (2 * _versine(z))


def _arc_shares(squared: float, s: float) -> tuple[float, float]:
    square = s * s
    return (square * _versine(squared * square) - s * _versine(squared),
            (square * s) * _lag(squared * square) - s * _lag(squared))


def _column(pose: Array, k: int) -> Vector:
    return float(pose[0, k]), float(pose[1, k]), float(pose[2, k])


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _scaled(s: float, a: Vector) -> Vector:
    return s * a[0], s * a[1], s * a[2]


def _squared(a: Vector) -> float:
    return a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
