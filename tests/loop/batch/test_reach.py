"""A map of reachable poses, compared with the ring that three links reach, and with their manipulability."""

import numpy as np
import pytest

from taskopt import Configuration, InvalidValue, ReachMap, UnknownName, planar_arm, reach_map
from taskopt.arrays import Array
from tests.helpers.robots import robot

LINKS = 0.5, 0.4, 0.2  # [m]
ARM = planar_arm(LINKS)


def planar_poses(count: int) -> Array:
    """Random poses in the plane of the arm, up to 1.3 m away."""
    rng = np.random.default_rng(3)
    turn, angle = rng.uniform(-np.pi, np.pi, (2, count))
    radius = rng.uniform(0.0, 1.3, count)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, 0, 0], poses[:, 1, 1] = np.cos(turn), np.cos(turn)
    poses[:, 1, 0], poses[:, 0, 1] = np.sin(turn), -np.sin(turn)
    poses[:, 0, 3], poses[:, 1, 3] = radius * np.cos(angle), radius * np.sin(angle)
    return poses


def in_the_ring(poses: Array) -> Array:
    """Distance [m] of the wrist of each pose inside the ring that the first two links reach."""
    wrist = poses[:, :2, 3] - LINKS[2] * poses[:, :2, 0]
    radius = np.linalg.norm(wrist, axis=1)
    return np.minimum(radius - (LINKS[0] - LINKS[1]), LINKS[0] + LINKS[1] - radius)


@pytest.mark.slow
def test_an_arm_of_three_links_reaches_what_its_ring_says() -> None:
    """Reached are the poses whose wrist lies in the ring; the posture is there, and w = a₁ a₂ |s₂|."""
    poses = planar_poses(60)
    inside = in_the_ring(poses)
    found = reach_map(ARM, "tip", poses, starts=6)
    assert 20 < found.reached.sum() < 50
    np.testing.assert_array_equal(found.reached[np.abs(inside) > 1e-3], (inside > 0.0)[np.abs(inside) > 1e-3])
    at = Configuration(ARM, ARM.neutral)
    for pose, q, w in zip(
        poses[found.reached], found.q[found.reached], found.manipulability[found.reached], strict=True
    ):
        at.update(q)
        np.testing.assert_allclose(at.pose("tip"), pose, atol=3e-6)
        assert w == pytest.approx(0.2 * abs(np.sin(q[1])), abs=1e-9)
    assert np.isnan(found.q[~found.reached]).all()
    assert repr(found) == f"<ReachMap of tip of planar3: {found.reached.sum()} of 60 poses reached>"


def test_postures_keep_the_limits_and_further_rounds_only_improve() -> None:
    """A second round begins at what was found; no joint of the Panda is out of its range."""
    panda = robot("panda")
    at = Configuration(panda, panda.posture("default")).pose("panda_hand")
    poses = np.tile(at, (9, 1, 1))
    poses[:, 2, 3] += np.linspace(-0.5, 0.5, 9)
    one, two = (reach_map(panda, "panda_hand", poses, starts=2, rounds=k, threads=1) for k in (1, 2))
    assert (two.reached >= one.reached).all()
    assert two.reached.sum() >= 4
    better = one.reached
    assert (two.manipulability[better] >= one.manipulability[better]).all()
    q = two.q[two.reached]
    assert (q >= panda.position_lower - 1e-9).all()
    assert (q <= panda.position_upper + 1e-9).all()


def test_one_pose_out_of_reach_is_no_error() -> None:
    """The map says so, also where a pose has no neighbours."""
    pose = np.eye(4)[None]
    pose[0, 0, 3] = 2.0
    found = reach_map(ARM, "tip", pose, starts=2)
    assert not found.reached.any()
    assert isinstance(found, ReachMap)


@pytest.mark.parametrize(
    ("poses", "options", "told"),
    [
        (np.zeros((0, 4, 4)), {}, "at least, got none"),
        (np.eye(4), {}, "poses"),
        (np.zeros((2, 4, 4)), {}, "pose 0"),
        (np.eye(4)[None], {"starts": 0}, "starts must be a whole number from 1 on, got 0"),
        (np.eye(4)[None], {"rounds": 1.5}, "rounds must be"),
    ],
)
def test_wrong_input_is_named(poses: Array, options: dict[str, int], told: str) -> None:
    """Each with what was expected."""
    with pytest.raises(InvalidValue, match=told):
        reach_map(ARM, "tip", poses, **options)
    with pytest.raises(UnknownName, match="nowhere"):
        reach_map(ARM, "nowhere", np.eye(4)[None])
