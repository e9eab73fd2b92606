"""The recording of a map of reachable poses: points with colours, and the robot in each posture."""

import numpy as np
import pytest

from taskopt import InvalidValue, reach_map, record_reach_map
from taskopt.recording.viewer.palette import RAMP, ramp
from tests.helpers.robots import robot
from tests.helpers.rrd import entities, rows_of

ARM = robot("planar")


def poses(*points):
    """Poses of the tip at points of the plane, turned by nothing."""
    out = np.tile(np.eye(4), (len(points), 1, 1))
    out[:, :2, 3] = points
    return out


def test_the_recording_holds_every_pose(tmp_path):
    """Reached and missed poses are points; the posture of each reached one has its time."""
    found = reach_map(ARM, "tip", poses((1.2, 0.1), (1.0, 0.3), (3.0, 0.0)), starts=4)
    assert found.reached.tolist() == [True, True, False]
    path = record_reach_map(found, tmp_path / "map.rrd")
    assert {"/world/reached", "/world/missed", "/world/robot/joint1"} <= set(entities(path))
    value = rows_of(path, "/resolver/map/manipulability")["scalars"]
    np.testing.assert_allclose(np.ravel(list(value)), found.manipulability[:2], rtol=1e-6)


def test_nothing_to_record_is_named(tmp_path):
    """A map without a reached pose, and a file of another kind."""
    nothing = reach_map(ARM, "tip", poses((3.0, 0.0)), starts=1)
    with pytest.raises(InvalidValue, match=r"nothing to record: <ReachMap of tip of planar3: 0 of 1"):
        record_reach_map(nothing, tmp_path / "map.rrd")
    with pytest.raises(InvalidValue, match=r"a recording is a file \*\.rrd"):
        record_reach_map(nothing, tmp_path / "map.png")


def test_colours_run_from_the_first_to_the_last_of_the_ramp():
    """0 has the first colour, 1 the last; each channel of a number between lies between two colours."""
    first, between, last = ramp(np.array([0.0, 0.3, 1.0]))
    assert [int(c) for c in first] == [RAMP[0] >> 24 & 255, RAMP[0] >> 16 & 255, RAMP[0] >> 8 & 255]
    assert [int(c) for c in last] == [RAMP[-1] >> 24 & 255, RAMP[-1] >> 16 & 255, RAMP[-1] >> 8 & 255]
    assert not (between == first).all()
