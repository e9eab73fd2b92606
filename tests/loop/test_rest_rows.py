"""The kernels that write rows of damping agree with singular values by NumPy on random hierarchies."""

import numpy as np
import pytest

from taskopt import Hierarchy, Level
from taskopt.arrays import Array, Mask, StateArray
from taskopt.hierarchy.rest_layout import RestLayout
from taskopt.hierarchy.rest_rows import SAME, copy_declared, damp_all, damp_free
from tests.helpers import rest_by_singular_values
from tests.helpers.rest_by_singular_values import damping_of

N, DT = 6, 0.01
BASE = np.r_[np.full(N, -2.0), np.full(N, 2.0)]  # limits on speed
NO_OWNERS = np.zeros(0, dtype=np.int64)


class Tick:
    """A hierarchy of three levels in which ranks are lost, with joints and hard rows that hold."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        levels = []
        for m in rng.integers(1, 5, 3):
            A = rng.standard_normal((m, N))
            A[:, rng.random(N) < 0.2] = 0.0
            A[-1] = A[0] + 10.0 ** -rng.uniform(1.0, 8.0) * A[-1]
            levels.append(Level(A, rng.standard_normal(m), weight=10.0 ** rng.uniform(-2.0, 2.0)))
        lower, upper = BASE.reshape(2, N).copy()
        self.joints = rng.random(N) < 0.2
        upper[self.joints] = 0.3
        hard = Level(rng.standard_normal((2, N)), upper=np.ones(2))
        self.declared = Hierarchy(levels, box=(lower, upper), limits=hard)
        self.groups = np.zeros(self.declared.layout.row_count, dtype=np.int64)
        for k in range(1, 4):
            rows = self.declared.layout.rows_of_level(k)
            self.groups[rows] = np.minimum(k, 2) if k != 2 or seed % 2 else 0
        self.groups[2 : 2 + len(levels[0].A) // 2] = 3  # two groups in the first level
        self.hard = rng.random(2) < 0.5
        self.state = np.r_[self.joints, self.hard, np.zeros(self.declared.layout.row_count - 2)].astype(
            np.int8
        )
        self.x = rng.standard_normal(N)
        self.rows = RestLayout(self.declared.layout, self.groups)
        self.damped = self.rows.hierarchy(self.declared.norm)
        self.thresholds, self.held = np.zeros(4), np.full(N + 2, 2, dtype=np.int8)
        layout = self.rows.layout
        self.numbers = self.damped.buffer, self.declared.norm.copy(), layout.offsets, layout.columns
        columns = self.declared.layout.columns
        copy_declared(self.declared.buffer, columns, self.rows.sources, self.numbers, self.rows.kinds)

    def damp(self) -> int:
        state = np.zeros(self.rows.layout.width, dtype=np.int8)
        state[:N] = self.state[:N]
        state[N:][self.rows.sources >= 0] = self.state[N:]
        stops, arrangement = (BASE, NO_OWNERS, 0.0), (self.rows.kinds, self.rows.places)
        held, thresholds = self.held, self.thresholds
        return damp_free(self.numbers, arrangement, self.x, state, stops, held, DT, thresholds)

    def written(self, below: int, k: int) -> Array:
        place = int(self.rows.places[below, k])
        if place < 0:
            return np.zeros((0, N))
        asked = self.damped.lower[place : place + N] == 0.0
        np.testing.assert_array_equal(self.damped.A[place : place + N][~asked], 0.0)
        return self.damped.A[place : place + N][asked]


def differs(tick: Tick) -> bool:
    """Return True if a row of damping differs from that by singular values; their order does not matter."""
    tick.damp()
    state: StateArray = tick.state
    joints: Mask = tick.joints
    expected = damping_of(tick.declared, tick.groups, tick.x, state, joints, tick.hard, DT)
    none = np.zeros((0, N)), np.zeros((0, N))
    for k in range(1, 4):
        for below, rows in enumerate(expected.get(k, none)):
            own = tick.written(below, k)
            if rows.shape != own.shape or not np.allclose(own.T @ own, rows.T @ rows, rtol=1e-6, atol=1e-9):
                return True
    return False


@pytest.mark.parametrize("seed", range(60))
def test_rows_of_damping_are_those_of_singular_values(seed: int) -> None:
    """At each level, and below it; the Gram matrix of rows says what they damp."""
    assert not differs(Tick(seed))


def test_the_random_hierarchies_are_damped_at_every_level() -> None:
    """Else nothing would be compared."""
    ticks = [Tick(seed) for seed in range(60)]
    counts = {tick.damp() for tick in ticks}
    assert counts >= {0, 1}
    assert (np.array([tick.thresholds for tick in ticks]) > 0.0).sum(axis=0)[1:].min() > 0


@pytest.mark.parametrize(("name", "lie"), [("BELOW", 2e4), ("ROUNDS", 1), ("RANK", 1e-1)])
def test_planted_lies(name: str, lie: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another weight below, an ε² that is no fixed point, and another decision on ranks are seen."""
    monkeypatch.setattr(rest_by_singular_values, name, lie)
    assert any(differs(Tick(seed)) for seed in range(60))


def test_what_holds_as_before_is_told_and_nothing_is_written() -> None:
    """A second call is free; after a change of what holds it is not."""
    tick = Tick(1)
    assert tick.damp() >= 0
    before = tick.damped.buffer.copy()
    tick.x = 2.0 * tick.x
    assert tick.damp() == SAME
    np.testing.assert_array_equal(tick.damped.buffer, before)
    tick.state[N] = 0 if tick.state[N] else 1
    assert tick.damp() != SAME


def test_the_first_damping_is_that_of_all_unknowns_that_move_a_level() -> None:
    """Rows ε e_j, with ε² the threshold of the level; none at other levels."""
    tick = Tick(0)
    thresholds = np.array([0.0, 0.25, 0.0, 0.0])
    damp_all(tick.numbers, (tick.rows.kinds, tick.rows.places), thresholds)
    moved = np.abs(tick.declared.A[tick.declared.layout.rows_of_level(1)]).max(axis=0) > 0.0
    np.testing.assert_array_equal(tick.written(0, 1), 0.5 * np.eye(N)[moved])
    assert all(len(tick.written(0, k)) == 0 for k in (2, 3))
