# SPDX-License-Identifier: Apache-2.0
"""The C interface as other languages call it, through its binary form alone: the same bits as in Python. $WARMFRONT_C is the
library."""
import ctypes
import os

import numpy as np
import pytest

import warmfront

pytestmark = pytest.mark.skipif(not warmfront.has_engine(), reason="pybind11-dev is not installed")

SIZE, PTR, U32, I32, U64, F64 = ctypes.c_size_t, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_int32, ctypes.c_uint64, ctypes.c_double


class Scene(ctypes.Structure):
    _fields_ = [("size", SIZE), ("positions", PTR), ("type", I32), ("vertex_count", U32), ("faces", PTR), ("face_count", SIZE)]


class Frame(ctypes.Structure):
    _fields_ = [("size", SIZE), ("positions", PTR)]


class Options(ctypes.Structure):
    _fields_ = [("size", SIZE), ("tier", I32), ("report", I32), ("fields", U32), ("tolerance", F64), ("min_separation", F64)]


class Answer(ctypes.Structure):
    _fields_ = [("frame", U64), *((name, U64) for name in ("vf", "ee", "ve", "vv", "ef", "vh")), ("possible", U64),
                ("overlaps_at_start", U64), ("earliest_toi", F64), ("rows", SIZE), ("kind", PTR), ("status", PTR), ("vertices", PTR),
                ("features", PTR), ("toi", PTR), ("weights", PTR), ("normal", PTR), ("points", PTR)]


def column(pointer, dtype, *shape):
    count = int(np.prod(shape)) * np.dtype(dtype).itemsize
    return np.frombuffer(ctypes.string_at(pointer, count), dtype).reshape(shape)


def test_the_same_bits(cloth):
    library = ctypes.CDLL(os.environ["WARMFRONT_C"])
    library.wf_last_error.restype = ctypes.c_char_p
    library.wf_free.argtypes = [PTR]
    frames, faces = [np.ascontiguousarray(frame) for frame in cloth.frames[20:40]], np.ascontiguousarray(cloth.faces)
    scene, options, frame, answer, session = Scene(), Options(), Frame(), Answer(), PTR()
    for name, struct in (("scene", scene), ("options", options), ("frame", frame)):
        init = getattr(library, f"wf_{name}_init")
        init.argtypes, init.restype = [PTR, SIZE], None
        init(ctypes.byref(struct), ctypes.sizeof(struct))
    scene.positions, scene.type, scene.vertex_count = frames[0].ctypes.data, 1, len(frames[0])
    scene.faces, scene.face_count = faces.ctypes.data, len(faces)
    options.fields, options.min_separation = 1 | 2 | 4, 0.005
    assert library.wf_create(ctypes.byref(scene), ctypes.byref(options), ctypes.byref(session)) == 0, library.wf_last_error()
    library.wf_step.argtypes = [PTR, PTR, PTR, PTR, SIZE]
    found = 0
    with warmfront.Collider(frames[0], faces, options=warmfront.Options(fields=["weights", "normal", "points"],
                                                                        min_separation=0.005)) as here:
        for positions in frames[1:]:
            frame.positions = positions.ctypes.data
            assert library.wf_step(session, ctypes.byref(frame), None, ctypes.byref(answer), ctypes.sizeof(answer)) == 0
            told = here.step(positions)
            k = answer.rows
            found += k
            assert (answer.frame, k, answer.vf, answer.ee, answer.possible) == (told.frame, len(told), told.vf, told.ee, told.possible)
            if k == 0:
                continue
            for name, mine, dtype, shape in (("kind", told.kind, "u1", (k,)), ("status", told.status, "u1", (k,)),
                                             ("vertices", told.v, "u4", (k, 4)), ("toi", told.toi, "f8", (k,)),
                                             ("weights", told.weights, "f8", (k, 4)), ("normal", told.normal, "f8", (k, 3)),
                                             ("points", told.points, "f8", (k, 2, 3))):
                assert column(getattr(answer, name), dtype, *shape).tobytes() == mine.tobytes(), name
            features = column(answer.features, "u4", k, 2).astype(np.int64)
            faced = told.kind == warmfront.Kind.VERTEX_FACE
            assert (features[faced, 0] == told.v[faced, 0]).all() and (features[faced, 1] == told.faces[faced]).all()
            assert (features[~faced] == told.edges[~faced]).all()
    library.wf_free(session)
    assert found > 500
