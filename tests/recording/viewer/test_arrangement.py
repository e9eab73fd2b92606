"""The camera sees all robots, none of them behind another, and a circle as a circle."""

from itertools import pairwise

import numpy as np
import pytest

from taskopt.recording.viewer.arrangement import arrange, normal_of

TURN = np.linspace(0.0, 2.0 * np.pi, 50)
CIRCLES = {
    "across x": np.array([np.full(50, 0.5), 0.3 * np.cos(TURN), 0.6 + 0.3 * np.sin(TURN)]).T,
    "across y": np.array([0.5 + 0.3 * np.cos(TURN), np.full(50, -0.2), 0.6 + 0.3 * np.sin(TURN)]).T,
}
ROBOT = np.array([[-0.1, -0.15, 0.0], [0.6, 0.15, 1.0]])


def seen(points, camera):
    """Places in the picture, as shares of half its height at Rerun's opening of 55°."""
    look = camera.look_target - camera.position
    look = look / np.linalg.norm(look)
    right = np.cross(look, camera.up)
    right = right / np.linalg.norm(right)
    away = points - camera.position
    slope = np.tan(np.radians(27.5)) * (away @ look)
    return np.array([away @ right, away @ np.cross(right, look)]).T / slope[:, None]


@pytest.mark.parametrize("circle", CIRCLES)
@pytest.mark.parametrize("count", [1, 2, 5])
def test_all_is_in_the_picture_and_circles_are_round(circle, count):
    """Corners are within ±1, a circle is at least half as wide as high, and robots of a row are apart."""
    room = arrange([ROBOT], count, paths=[CIRCLES[circle]])
    camera = room.camera(count)
    middles = []
    for i in range(count):
        corners = np.array([room.lower, room.upper]) + room.offset(i)
        assert np.abs(seen(corners, camera)).max() <= 1.0
        drawn = seen(CIRCLES[circle] + room.offset(i), camera)
        width, height = np.ptp(drawn, axis=0)
        assert 0.5 * height < width < 2.0 * height
        middles.append((drawn[:, 0].min(), drawn[:, 0].max()))
    row = sorted(middles[: room.columns])
    assert all(before[1] < after[0] for before, after in pairwise(row))


def test_paths_without_an_upright_plane_have_no_normal():
    """A line, a level circle, and no path; a slanted circle has its own."""
    level = CIRCLES["across x"][:, [1, 2, 0]]
    line = np.outer(TURN, [1.0, 2.0, 0.5])
    assert normal_of([line, level]) is None
    assert normal_of([]) is None
    np.testing.assert_allclose(np.abs(normal_of([line, CIRCLES["across y"]])), [0.0, 1.0, 0.0], atol=1e-12)
