"""The experiments of docs/reproduced.md: each shows what its page says of it."""

import numpy as np
import pytest
import reproduced
from pink_programs import least_violation, motions


def test_the_hierarchical_method_changes_less_than_the_cascade_and_agrees_with_it() -> None:
    """Twelve problems of 20 unknowns."""
    (line,) = reproduced.profile((20,), 12)
    assert line[0] == "20"
    assert int(line[1]) < int(line[2])
    assert float(line[-1]) < 1e-9


def test_saturation_lies_between_plain_scaling_and_the_largest_factor() -> None:
    """For each demand; a larger one is met by a smaller share."""
    lines = [*reproduced.scale_factors(24)]
    for _, _, own, most, plain, _ in lines:
        assert float(plain) <= float(own) <= float(most) + 1e-9
    means = [float(line[2]) for line in lines]
    assert means == sorted(means, reverse=True)


def test_near_a_conflict_only_the_pseudo_inverse_grows_without_bound() -> None:
    """Its largest entry is about 1/gap; that of singularity-robust priority stays below 1."""
    for line in reproduced.near_a_conflict((1e-2, 1e-4)):
        gap = float(line[0])
        pinv, robust = (float(cell.partition(" ")[0]) for cell in (line[1], line[3]))
        assert 0.9 / gap < pinv < 1.1 / gap
        assert robust < 1.0


def test_only_the_limit_that_looks_ahead_keeps_the_range() -> None:
    """Bounds for the next tick alone leave it by the way that braking takes, v²/2a."""
    one, (_, alone, ahead) = reproduced.JOINT, next(reproduced.joint_limits((0.01,)))
    over, *rest = alone.split(" / ")
    assert float(over) == pytest.approx(one.velocity**2 / (2.0 * one.acceleration), rel=0.1)
    assert rest[:2] == ["0", "0"]
    assert float(rest[2].removesuffix(" %")) > 10.0
    assert ahead == "0 / 0 / 0 / 0 %"


def test_contradictory_rows_are_found() -> None:
    """x ≤ −1 and x ≥ 1 are 1 apart; x ≤ 1 and x ≥ 1 are not; a planted gap of 1e-6 is seen."""
    G = np.array([[1.0, 0.0], [-1.0, 0.0]])
    assert least_violation(G, np.array([-1.0, -1.0])) == pytest.approx(1.0)
    assert least_violation(G, np.array([1.0, -1.0])) == pytest.approx(0.0, abs=1e-9)
    assert least_violation(G, np.array([1.0 - 2e-6, -1.0])) == pytest.approx(1e-6, rel=1e-3)


@pytest.mark.slow
def test_programs_that_all_solvers_fail_have_no_solution() -> None:
    """Each is of a robot that starts outside its limits; every other program is answered by some solver."""
    pytest.importorskip("pink_motions")
    pytest.importorskip("proxsuite")
    found = dict(motions(3))
    assert len(found) >= 10
    for one in found.values():
        assert one.missed == 0
        assert one.outside > 0 or one.contradictory == 0
        assert max(one.answered.values()) == one.total - one.contradictory
    assert found["talos"].contradictory == 3
