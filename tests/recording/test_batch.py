"""Batches: the columns of a run say what its steps say."""

import numpy as np
import pytest

from taskopt.recording.batch import Batch


@pytest.mark.slow
@pytest.mark.parametrize("name", ["active-set", "wqp/daqp", "pinv"])
def test_columns_are_the_steps_stacked(steps, name):
    """Row k of every column is step k."""
    batch = Batch(tuple(steps[name]))
    for k, step in enumerate(steps[name]):
        np.testing.assert_array_equal(batch.q[k], step.q)
        np.testing.assert_array_equal(batch.q_next[k], step.q_next)
        np.testing.assert_array_equal(batch.v[k], step.v)
        assert (batch.index[k], batch.t[k], batch.seconds[k]) == (step.index, step.t, step.seconds)
        assert batch.closed_form_distance[k] == step.closed_form_distance
        assert batch.kkt_residual[k] == step.resolution.certificate.worst
        assert batch.verdicts[k] is step.resolution.certificate.verdict
        np.testing.assert_array_equal(batch.error_bound[k], step.resolution.certificate.error_bound)


@pytest.mark.parametrize("name", ["active-set", "wqp/daqp"])
def test_active_rows_are_those_that_the_resolution_names(steps, name):
    """Limits in the batch are those of `Resolution.active`, with the same multipliers."""
    batch = Batch(tuple(steps[name]))
    assert (batch.active_code != 0).any(), "the scenario must bind, or this shows nothing"
    for k, step in enumerate(steps[name]):
        code = batch.active_code[k]
        rows = np.flatnonzero(code)
        got = {
            batch.active_name(int(row), int(batch.active_code[k, row])): batch.multiplier[k, row]
            for row in rows
        }
        limits = [
            a for a in step.resolution.active if not a.name.startswith(("tip", "posture", "joint/", "norm"))
        ]
        expected = {str(a): a.multiplier for a in limits if a.name.split("/")[0] in batch.layout.owners}
        assert got == expected


def test_a_wrong_state_would_be_seen(steps):
    """The comparison above is not blind: a flipped side changes the name."""
    batch = Batch(tuple(steps["active-set"]))
    k, row = (int(i[0]) for i in np.nonzero(batch.active_code))
    code = int(batch.active_code[k, row])
    assert batch.active_name(row, code) != batch.active_name(row, -code)


def test_residuals_are_those_of_the_resolution(steps):
    """‖A x − nearest allowed value‖ per task agrees with the resolution's own rows."""
    batch = Batch(tuple(steps["active-set"]))
    for block in batch.layout.blocks:
        norms = batch.residual(block.name)
        for k, step in enumerate(steps["active-set"]):
            own = np.linalg.norm(step.resolution.residuals[block.name])
            assert norms[k] == pytest.approx(own, abs=1e-12)


def test_times_are_whole_nanoseconds(steps):
    """5 ms apart exactly, so that rows of different columns join."""
    nanoseconds = Batch(tuple(steps["pinv"])).time.astype(np.int64)
    assert set(np.diff(nanoseconds)) == {5_000_000}


def test_a_closed_form_that_leaves_its_limits_is_marked(steps, scenario):
    """`violated` is ±1 exactly where |v| exceeds 0.9 rad/s, and never for the optimiser."""
    batch = Batch(tuple(steps["pinv"]))
    over = np.sign(batch.v) * (np.abs(batch.v) > 0.9 + 1e-9)
    assert over.any()
    np.testing.assert_array_equal(batch.violated[:, : batch.layout.n], over)
    assert not Batch(tuple(steps["active-set"])).violated.any()
