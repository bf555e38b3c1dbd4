# SPDX-License-Identifier: Apache-2.0
"""What is accepted as an array, copied only where necessary."""
import numpy as np
import pytest
from support import bits, triangle_through_triangle

import warmfront
from warmfront import InvalidArgumentError
from warmfront.scene import faces_of, indices_of, positions_of

BEFORE, AFTER, FACES = triangle_through_triangle()
F4, F8 = np.dtype("<f4"), np.dtype("<f8")


class Foreign:
    """Another library's array, which numpy knows by DLPack alone. device: as DLPack numbers them, 1 for the CPU."""

    def __init__(self, array, device=1):
        self._array = array
        self._device = device

    def __dlpack__(self, **arguments):
        return self._array.__dlpack__(**arguments)

    def __dlpack_device__(self):
        return self._device, 0


class Elsewhere:
    """On a GPU."""

    def __dlpack__(self, **_):
        raise BufferError("it lies on cuda:0")

    def __dlpack_device__(self):
        return 2, 0

    def __array__(self, *_):
        raise TypeError("can't convert cuda:0 device type tensor to numpy")


@pytest.mark.parametrize("kind", ["i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f2", "f4", "f8", ">f4", ">f8", ">i4", "g"])
@pytest.mark.parametrize("dtype", [F4, F8])
def test_whatever_converts_exactly(kind, dtype):
    values = np.arange(18).reshape(6, 3).astype(kind)
    assert (positions_of(values, 6, dtype) == np.arange(18).reshape(6, 3)).all()
    assert positions_of(values, 6, dtype).dtype == dtype
    assert positions_of(Foreign(values), 6, dtype).dtype == dtype if kind[0] not in ">g" else True


@pytest.mark.parametrize("value, dtype, named", [
    (np.float64(0.1), F4, "0.1 is not exactly a float32"), (1e300, F4, "is not exactly a float32"),
    (2**24 + 1, F4, "16777217 is not exactly a float32"), (np.uint64(2**64 - 1), F8, "18446744073709551615 is not exactly"),
    (np.longdouble("0.1"), F8, "is not exactly a float64"),
])
def test_what_does_not_is_refused(value, dtype, named):
    values = np.zeros((6, 3), np.asarray(value).dtype)
    values[4, 1] = value
    for given in (values, values.tolist() if dtype == F4 else values):
        with pytest.raises(InvalidArgumentError, match=rf"positions\[4, 1\]: .*{named}"):
            positions_of(given, 6, dtype)


@pytest.mark.parametrize("wrap", [lambda array: array, Foreign])
@pytest.mark.parametrize("dtype", [F4, F8])
def test_memory_that_fits_is_not_copied(wrap, dtype):
    values = np.zeros((6, 3), dtype)
    assert np.shares_memory(positions_of(wrap(values), 6, dtype), values)
    assert np.shares_memory(positions_of(wrap(values), None, None), values)
    faces = np.zeros((2, 3), np.int32)
    assert np.shares_memory(faces_of(wrap(faces)), faces)


def test_arrays_elsewhere_say_so():
    for call in (lambda: positions_of(Elsewhere(), 6, F8), lambda: faces_of(Elsewhere()), lambda: indices_of(Elsewhere(), "vertices")):
        with pytest.raises(InvalidArgumentError, match="Elsewhere; .*cuda:0.*bring it to the CPU first"):
            call()


def test_a_session_of_foreign_arrays(anywhere):
    with anywhere.session(BEFORE, FACES) as session:
        expected = bits(session.step(AFTER))
    with anywhere.session(Foreign(BEFORE), Foreign(FACES)) as session:
        assert bits(session.step(Foreign(AFTER))) == expected
    with anywhere.session(BEFORE, FACES.astype(np.uint8)) as session:
        assert bits(session.step(AFTER.astype(np.float32))) == expected  # exactly float64
        session.step(vertices=Foreign(np.array([3, 4])), vertex_positions=Foreign(BEFORE[3:5]))
        with pytest.raises(warmfront.InvalidArgumentError):
            session.step(vertices=[0.5], vertex_positions=BEFORE[:1])
