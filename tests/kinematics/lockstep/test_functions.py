"""Packs and their functions: what compiled code does is what NumPy does."""

import numpy as np
import pytest

from taskopt.jit import kernel_apart
from taskopt.jit.pack import PACK, any_less, load, nearest, root, size, spread, store, where_less
from taskopt.kinematics.lockstep.functions import angle_of, sine_cosine


@kernel_apart
def operations(a, out):
    """Write the result of each operation on packs 0 and 1 of `a`; return what `any_less` says."""
    x, y = load(a, 0), load(a, 1)
    store(out, 0, x + y - 2.0 * x)
    store(out, 1, x / y + 1.0)
    store(out, 2, -x)
    store(out, 3, root(size(x)))
    store(out, 4, nearest(3.0 * x))
    store(out, 5, where_less(x, y, 1.0, x))
    store(out, 6, spread(2.5))
    return any_less(x, y), any_less(100.0, y)


@kernel_apart
def elementary(a, out):
    """Write sine, cosine and angle."""
    s, c = sine_cosine(load(a, 0))
    store(out, 0, s)
    store(out, 1, c)
    store(out, 2, angle_of(size(s), size(c)))


def test_operations_are_those_of_numpy() -> None:
    """Every operation, on eight numbers each."""
    a = np.random.default_rng(1).normal(size=(2, PACK))
    x, y = a
    out = np.zeros((7, PACK))
    assert operations(a, out) == (True, False)
    expected = [
        x + y - 2 * x,
        x / y + 1,
        -x,
        np.sqrt(np.abs(x)),
        np.rint(3 * x),
        np.where(x < y, 1.0, x),
        2.5 + 0 * x,
    ]
    np.testing.assert_allclose(out, expected, rtol=1e-15, atol=1e-15)


def test_comparisons_with_nan_are_false() -> None:
    """Compiled as in NumPy."""
    a = np.full((2, PACK), np.nan)
    out = np.zeros((7, PACK))
    assert operations(a, out) == (False, False)
    assert np.isnan(out[5]).all()


@pytest.mark.parametrize("scale", [1e-9, 1.0, 10.0, 1e5])
def test_functions_are_right_to_the_last_digits(scale: float) -> None:
    """Against NumPy, whose own errors are below one unit in the last place."""
    rng, out = np.random.default_rng(3), np.zeros((3, PACK))
    for _ in range(200):
        x = rng.uniform(-scale, scale, (1, PACK))
        elementary(x, out)
        np.testing.assert_allclose(out[:2], [np.sin(x[0]), np.cos(x[0])], rtol=0.0, atol=2.3e-16)
        angle = np.arctan2(np.abs(out[0]), np.abs(out[1]))
        np.testing.assert_allclose(out[2], angle, rtol=5e-16, atol=0.0)


def test_multiples_of_a_quarter_turn() -> None:
    """Where the reduction of the angle loses most."""
    x, out = np.pi / 2.0 * np.arange(-4.0, 4.0)[None], np.zeros((3, PACK))
    elementary(np.ascontiguousarray(x), out)
    np.testing.assert_allclose(out[:2], [np.sin(x[0]), np.cos(x[0])], rtol=1e-15, atol=1e-25)
