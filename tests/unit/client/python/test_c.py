# SPDX-License-Identifier: Apache-2.0
"""The C interface as other languages call it, through its binary form alone: the same bits as in Python. $WARMFRONT_C is the
library."""
import ctypes
import os

import numpy as np
import pytest

import warmfront

pytestmark = pytest.mark.skipif(not warmfront.has_engine(), reason="this package has no engine: built without pybind11-dev, or with sanitizers")

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


class Body(ctypes.Structure):
    _fields_ = [("size", SIZE), ("name", ctypes.c_char_p), ("vertex_count", U32), ("kind", I32), ("self_collision", I32), ("group", U32),
                ("mask", U32), ("world", U32), ("thickness", F64)]


class SceneWithBodies(ctypes.Structure):
    _fields_ = [*Scene._fields_, ("edges", PTR), ("edge_count", SIZE), ("bodies", PTR), ("body_count", SIZE)]


class Change(ctypes.Structure):
    _fields_ = [("size", SIZE), ("what", I32), ("index", U32), ("body", PTR), ("vertex_count", U32), ("positions", PTR),
                ("thickness", PTR), ("faces", PTR), ("face_count", SIZE), ("edges", PTR), ("edge_count", SIZE), ("within_edges", U32),
                ("near_at_rest", F64), ("rest_positions", PTR), ("excluded_vertex_pairs", PTR), ("excluded_vertex_pair_count", SIZE),
                ("patches", PTR), ("excluded_pairs", PTR), ("excluded_pair_count", SIZE)]


@pytest.fixture
def library():
    library = ctypes.CDLL(os.environ["WARMFRONT_C"])
    library.wf_last_error.restype = ctypes.c_char_p
    library.wf_free.argtypes = [PTR]
    library.wf_step.argtypes = [PTR, PTR, PTR, PTR, SIZE]
    library.wf_change_scene.argtypes = [PTR, PTR, SIZE, PTR, PTR]
    return library


def initial(library, what, struct, **fields):
    """The struct as wf_WHAT_init() leaves it, but for these fields; an array is given by where its numbers are."""
    init = getattr(library, f"wf_{what}_init")
    init.argtypes, init.restype = [PTR, SIZE], None
    init(ctypes.byref(struct), ctypes.sizeof(struct))
    for field, value in fields.items():
        setattr(struct, field, value.ctypes.data if isinstance(value, np.ndarray) else value)
    return struct


def column(pointer, dtype, *shape):
    count = int(np.prod(shape)) * np.dtype(dtype).itemsize
    return np.frombuffer(ctypes.string_at(pointer, count), dtype).reshape(shape)


def same_step(library, session, here, positions):
    """One step there and here, whose rows are compared; how many there are."""
    frame, answer = initial(library, "frame", Frame(), positions=positions), Answer()
    assert library.wf_step(session, ctypes.byref(frame), None, ctypes.byref(answer), ctypes.sizeof(answer)) == 0, library.wf_last_error()
    told = here.step(positions)
    k = answer.rows
    assert (answer.frame, k, answer.vf, answer.ee, answer.possible) == (told.frame, len(told), told.vf, told.ee, told.possible)
    if k == 0:
        return 0
    for name, mine, dtype, shape in (("kind", told.kind, "u1", (k,)), ("status", told.status, "u1", (k,)),
                                     ("vertices", told.v, "u4", (k, 4)), ("toi", told.toi, "f8", (k,)),
                                     ("weights", told.weights, "f8", (k, 4)), ("normal", told.normal, "f8", (k, 3)),
                                     ("points", told.points, "f8", (k, 2, 3))):
        assert column(getattr(answer, name), dtype, *shape).tobytes() == mine.tobytes(), name
    features = column(answer.features, "u4", k, 2).astype(np.int64)
    faced = told.kind == warmfront.Kind.VERTEX_FACE
    assert (features[faced, 0] == told.v[faced, 0]).all() and (features[faced, 1] == told.faces[faced]).all()
    assert (features[~faced] == told.edges[~faced]).all()
    return k


FIELDS = {"fields": 1 | 2 | 4, "min_separation": 0.005}
OPTIONS = warmfront.Options(fields=["weights", "normal", "points"], min_separation=0.005)


def test_the_same_bits(cloth, library):
    frames, faces = [np.ascontiguousarray(frame) for frame in cloth.frames[20:40]], np.ascontiguousarray(cloth.faces)
    scene = initial(library, "scene", Scene(), positions=frames[0], type=1, vertex_count=len(frames[0]), faces=faces, face_count=len(faces))
    options, session = initial(library, "options", Options(), **FIELDS), PTR()
    assert library.wf_create(ctypes.byref(scene), ctypes.byref(options), ctypes.byref(session)) == 0, library.wf_last_error()
    with warmfront.Collider(frames[0], faces, options=OPTIONS) as here:
        found = sum(same_step(library, session, here, positions) for positions in frames[1:])
    library.wf_free(session)
    assert found > 500


def test_the_same_bits_after_changes(cloth, library):
    """A ball is added that falls onto the cloth, the cloth is replaced by its part, then by fewer faces, and filters, pairs,
    descriptions and options are changed: each as Python's function of that name."""
    frames, faces = [np.ascontiguousarray(frame) for frame in cloth.frames[20:40]], np.ascontiguousarray(cloth.faces)
    n = len(frames[0])
    body = initial(library, "body", Body(), vertex_count=n, name=b"cloth")
    scene = initial(library, "scene", SceneWithBodies(), positions=frames[0], type=1, vertex_count=n, faces=faces, face_count=len(faces),
                    bodies=ctypes.addressof(body), body_count=1)
    options, session = initial(library, "options", Options(), **FIELDS), PTR()
    assert library.wf_create(ctypes.byref(scene), ctypes.byref(options), ctypes.byref(session)) == 0, library.wf_last_error()
    piece = np.ascontiguousarray(frames[0][:3] + np.float32([0, 0, 0.01]))
    corner, fewer = np.int32([[0, 1, 2]]), np.ascontiguousarray(faces[::2])
    pairs = np.uint32([[0, 1]])
    thick = initial(library, "body", Body(), thickness=0.001)

    def change(what, **fields):
        one = initial(library, "change", Change(), **fields)
        one.what = what
        assert library.wf_change_scene(session, ctypes.byref(one), 1, None, None) == 0, library.wf_last_error()

    def both(frame):
        """Where everything goes: the piece falls through the cloth."""
        return np.concatenate([frame, piece - np.float32([0, 0, 0.002 * here.last_frame])])

    with warmfront.Collider(frames[0], faces, bodies=[warmfront.Body(n, name="cloth")], options=OPTIONS) as here:
        found = [same_step(library, session, here, frames[1])]
        change(0, vertex_count=3, positions=piece, faces=corner, face_count=1)
        assert here.add_body(warmfront.Body(3), corner, piece) == 1
        found.append(same_step(library, session, here, both(frames[2])))
        change(3, faces=fewer, face_count=len(fewer))
        here.replace_elements(0, fewer)
        found.append(same_step(library, session, here, both(frames[3])))
        change(1, index=1, body=ctypes.addressof(thick))
        here.change_body(1, warmfront.Body(3, thickness=0.001))
        found.append(same_step(library, session, here, both(frames[4])))
        change(2, index=0, vertex_count=n, positions=frames[9], faces=faces, face_count=len(faces))
        here.replace_body(0, frames[9], faces)
        found.append(same_step(library, session, here, both(frames[10])))
        change(4, within_edges=2)
        here.change_filters(dict(within_edges=2))
        found.append(same_step(library, session, here, both(frames[11])))
        change(5, excluded_pairs=pairs, excluded_pair_count=1)
        here.change_excluded_pairs([(0, 1)])
        found.append(same_step(library, session, here, both(frames[12])))
        wider = initial(library, "options", Options(), fields=7, min_separation=0.02)
        assert library.wf_change_scene(session, None, 0, ctypes.byref(wider), None) == 0, library.wf_last_error()
        here.change_options(warmfront.Options(fields=["weights", "normal", "points"], min_separation=0.02))
        found.append(same_step(library, session, here, both(frames[13])))
    library.wf_free(session)
    assert min(found) > 0 and len(set(found)) > 4
