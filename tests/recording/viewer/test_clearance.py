"""Obstacles in a recording: what is drawn is what was measured, and every picture says who is too near."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from taskopt import InvalidValue
from taskopt.kinematics.collision.measure import Measured
from taskopt.kinematics.collision.model import Collision
from taskopt.kinematics.geometry import Box, Capsule, HalfSpace, Sphere
from taskopt.kinematics.limit import JointVelocityLimit, ObstacleLimit, SelfCollisionLimit
from taskopt.kinematics.objective import ObstacleDistance
from taskopt.kinematics.robot import planar_arm
from taskopt.kinematics.stack import Stack
from taskopt.kinematics.target import Line
from taskopt.kinematics.task import GradientTask, OrientationTask, PositionTask
from taskopt.loop.run import run
from taskopt.loop.scenario import Scenario
from taskopt.recording.batch import Batch
from taskopt.recording.log import Log
from taskopt.recording.reading import read_table
from taskopt.recording.recorder import BufferedRecorder
from taskopt.recording.run_info import RunInfo
from taskopt.recording.viewer.clearance import nearest_pairs
from taskopt.recording.viewer.obstacles import obstacle_corners
from taskopt.recording.viewer.palette import NEAR, UPPER, VIOLATED
from taskopt.recording.viewer.paths import (
    data_path,
    escaped_part,
    least_distance_path,
    margin_path,
    pair_path,
)
from taskopt.recording.viewer.plots import multiplier_lines
from taskopt.recording.viewer.rows import pair_rows
from taskopt.recording.viewer.scene import Scene
from taskopt.recording.viewer.sink import RecordingSink
from taskopt.recording.viewer.summary_panel import SummaryPanel
from taskopt.recording.violation import LimitGauge
from taskopt.resolver.registry import resolver
from tests.helpers.rrd import batches, entities, layout_words, rows_of, written_in_pieces

NAMES = ("active-set", "pinv")
MARGIN, INFLUENCE = 0.02, 0.15
OBSTACLES = (Sphere((0.85, -0.15, 0.0), 0.1, name="ball"), HalfSpace((0.0, 1.0, 0.0), -1.0, name="wall"))
WORLD = "/world/active-set"


@pytest.fixture(scope="module")
def near():
    """A line that leads into a ball: the optimiser stays 2 cm away, the closed form does not."""
    line = PositionTask("tip", target=Line(by=(0.0, -0.5, 0.0), duration=0.4), axes="xy", gain=10.0)
    turn = OrientationTask("tip", axes="y", name="turn")
    limits = [
        ObstacleLimit(OBSTACLES, MARGIN, influence=INFLUENCE),
        SelfCollisionLimit(name="itself"),
        JointVelocityLimit(velocity=6.0),
    ]
    return Scenario(
        robot=planar_arm([0.5, 0.4, 0.3], radius=0.02),
        q0=[0.6, -0.9, 0.8],
        stack=Stack([[line], [turn]], limits),
        duration=0.5,
        dt=5e-3,
        name="near",
        description="A ball in the way.",
    )


@pytest.fixture(scope="module")
def info(near):
    return RunInfo(near, NAMES, Path(__file__))


@pytest.fixture(scope="module")
def steps(near):
    return {name: list(run(near, resolver(name))) for name in NAMES}


@pytest.fixture(scope="module")
def folder(tmp_path_factory, info, steps):
    log = Log(info, tmp_path_factory.mktemp("near"))
    with log:
        for ticks in zip(*steps.values(), strict=True):
            for step in ticks:
                log.write(step)
    return log.folder


def test_the_run_is_one_worth_drawing(steps):
    """The optimiser is held off and keeps the margin; the closed form goes into the ball."""
    least = {
        name: min(step.distances["obstacle"].distance.min() for step in own) for name, own in steps.items()
    }
    assert least["active-set"] >= MARGIN
    assert least["pinv"] < 0.0
    held = {active.name for step in steps["active-set"] for active in step.resolution.active}
    assert any(name.startswith("obstacle/link") for name in held)


def test_steps_carry_the_distances_of_their_own_posture(near, steps):
    """d and the witness points are those of a fresh measurement at q, for the limits that keep distances."""
    fresh = Collision.with_obstacles(near.robot, OBSTACLES)
    plan = near.stack.compile(near.robot, near.dt)
    for step in steps["active-set"][::20]:
        assert list(step.distances) == ["obstacle", "itself"]
        plan.at(step.q, step.t)
        again = plan.distance_limits["obstacle"].distances
        distance, witness = step.distances["obstacle"]
        np.testing.assert_allclose(distance, again.distance, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(witness[:, 1] - witness[:, 0], axis=1), distance, atol=1e-9)
        assert len(distance) == len(fresh.names)


def test_a_step_without_distance_limits_carries_none(near):
    """Nothing is measured that no limit asks for."""
    free = replace(near, stack=Stack(near.stack.levels), duration=near.dt)
    (step,) = run(free, resolver("active-set"))
    assert step.distances == {}
    assert RunInfo(free, NAMES).plan.obstacles == {}


def test_the_nearest_pairs_are_drawn_with_their_witness_points(folder, steps):
    """At 25 Hz: a segment for each of the nearest pairs within the influence, from link to obstacle."""
    rows = rows_of(folder / "run.rrd", f"{WORLD}/distance/obstacle")
    assert np.diff(rows["tick"]).tolist() == [8] * (len(rows["tick"]) - 1)
    most = 0
    for tick, strips in zip(rows["tick"], rows["strips"], strict=True):
        distance, witness = steps["active-set"][tick].distances["obstacle"]
        known = sorted(d for d in distance if d < INFLUENCE)[:3]
        drawn = np.array(strips or []).reshape(-1, 2, 3)
        most = max(most, len(drawn))
        lengths = np.linalg.norm(drawn[:, 1] - drawn[:, 0], axis=1)
        np.testing.assert_allclose(sorted(lengths), known, atol=1e-6)
        for segment in drawn:
            assert np.abs(witness - segment).max(axis=(1, 2)).min() < 1e-6
    assert most == 2


def test_segments_are_red_while_held_and_yellow_below_the_margin(folder, steps):
    """The colour of each segment follows from its distance and the state of its row."""
    seen = set()
    for name in NAMES:
        rows = rows_of(folder / "run.rrd", f"/world/{name}/distance/obstacle")
        for tick, paint in zip(rows["tick"], rows["colors"], strict=True):
            step = steps[name][tick]
            distance = step.distances["obstacle"].distance
            state = step.resolution.state[3 : 3 + len(distance)]
            shown = np.flatnonzero(nearest_pairs(distance[None], INFLUENCE)[0])
            expected = [
                VIOLATED if distance[p] < MARGIN - 1e-9 else UPPER if state[p] else NEAR for p in shown
            ]
            assert (paint or []) == expected
            seen |= set(expected)
    assert seen == {VIOLATED, UPPER, NEAR}


def test_the_number_in_the_scene_is_the_least_distance(folder, steps):
    """In whole millimetres, and only where something is within the influence."""
    rows = rows_of(folder / "run.rrd", f"{WORLD}/distance/obstacle/least")
    numbers = 0
    for tick, label in zip(rows["tick"], rows["labels"], strict=True):
        least = steps["active-set"][tick].distances["obstacle"].distance.min()
        assert (label or []) == ([f"{1e3 * least:.0f} mm"] if least < INFLUENCE else [])
        numbers += len(label or [])
    assert numbers > 5


def test_distance_plots_begin_when_a_pair_comes_near(folder, info, steps):
    """Each pair's line is its distance at 100 Hz from the first tick at which it is one of the nearest."""
    names = info.plan.distance_limits["obstacle"].row_names
    every = np.array([step.distances["obstacle"].distance for step in steps["active-set"]])[::2]
    shown = nearest_pairs(every, INFLUENCE)
    known = entities(folder / "run.rrd")
    for pair, name in enumerate(names):
        path = pair_path("active-set", "obstacle", name)
        assert (path in known) == shown[:, pair].any()
        if path in known:
            begin = int(shown[:, pair].argmax())
            rows = rows_of(folder / "run.rrd", path)
            assert rows["tick"] == list(range(2 * begin, len(steps["active-set"]), 2))
            np.testing.assert_array_equal(np.ravel(rows["scalars"]), every[begin:, pair])
    least = rows_of(folder / "run.rrd", least_distance_path("active-set", "obstacle"))["scalars"]
    np.testing.assert_array_equal(np.ravel(least), every.min(axis=1))
    margin = rows_of(folder / "run.rrd", margin_path("obstacle"))["scalars"]
    assert set(np.ravel(margin)) == {MARGIN}


@pytest.mark.slow
def test_batches_of_any_size_draw_the_same_distances(info, steps, tmp_path):
    """Cutting a run into pieces changes neither lines, nor their beginnings, nor their colours."""
    files = written_in_pieces(info, steps["active-set"], tmp_path)
    paths = {p for p in entities(files[0]) if p.startswith(("/world/", "/resolver/"))}
    assert paths == {p for p in entities(files[1]) if p.startswith(("/world/", "/resolver/"))}
    for path in sorted(paths):
        one, other = (rows_of(file, path) for file in files)
        assert one == other, path
        fixed = [
            [b.column(n).to_pylist() for b in batches(file, path) for n in b.schema.names if "colors" in n]
            for file in files
            if not one
        ]
        assert not fixed or fixed[0] == fixed[1], path


def test_every_obstacle_stands_in_the_scene_of_every_resolver(folder):
    """Once for each robot, a half-space too; a task that only turns a frame has no path."""
    known = entities(folder / "run.rrd")
    for name in NAMES:
        assert {f"/world/{name}/obstacle/ball", f"/world/{name}/obstacle/wall"} <= known
    assert f"{WORLD}/task/turn/target" in known
    assert not {f"{WORLD}/task/turn/{kind}" for kind in ("error", "actual", "desired")} & known


def test_a_flat_arm_stays_flat_and_the_camera_sees_its_obstacles(info):
    """Room for the ball, not for its thickness; the half-space has no end and claims none."""
    room = Scene(info).arrangement
    assert room.flat
    assert room.lower[1] <= -0.25
    assert room.upper[2] - room.lower[2] < 0.05


@pytest.mark.parametrize(
    "shape",
    [
        Sphere((0.1, 0.2, 0.3), 0.4),
        Capsule((0.0, -1.0, 0.5), (1.0, 0.3, 0.2), 0.2),
        Box(np.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1.0]]), (0.2, 0.4, 0.6)),
    ],
)
def test_the_box_around_an_obstacle_is_tight(shape):
    """Every support of the shape lies on a face: checked along the six axes in closed form."""
    lower, upper = obstacle_corners(shape)
    match shape:
        case Sphere():
            expected = np.array([[-0.3, -0.2, -0.1], [0.5, 0.6, 0.7]])
        case Capsule():
            expected = np.array([[-0.2, -1.2, 0.0], [1.2, 0.5, 0.7]])
        case Box():
            expected = np.array([[0.8, 1.9, 2.7], [1.2, 2.1, 3.3]])
    np.testing.assert_allclose([lower, upper], expected, atol=1e-12)


def test_obstacles_of_an_objective_are_drawn_too(near):
    """Each once, whoever names it."""
    ball, other = OBSTACLES[0], Sphere((0.0, 1.0, 0.0), 0.1, name="other")
    climb = GradientTask(ObstacleDistance([ball, other]))
    stack = Stack([*near.stack.levels, [climb]], near.stack.limits)
    assert list(RunInfo(replace(near, stack=stack), NAMES).plan.obstacles.values()) == [
        *OBSTACLES,
        other,
    ]


def test_timeline_rows_of_distance_limits_say_held_off_under_plain_names(folder):
    """The timeline row of a pair is red, says what the row does, and its title needs no escapes."""
    rows = [
        p for p in entities(folder / "run.rrd") if p.startswith(data_path("active-set", "active", "obstacle"))
    ]
    assert rows
    assert not any("\\" in row for row in rows)
    labels = [
        label
        for batch in batches(folder / "run.rrd", rows[0])
        for name in batch.schema.names
        if name.endswith("labels")
        for label in batch.column(name).to_pylist()[0]
    ]
    assert {"held off", "too fast", "free"} <= set(labels)
    assert "lower" not in labels


def test_all_pairs_of_a_limit_share_one_line_of_multipliers(folder, info, steps):
    """The line is the multiplier of the pair that costs most; the others are bounds, by joint."""
    names = list(multiplier_lines(info))
    assert names == ["obstacle", "itself", "joint1", "joint2", "joint3"]
    lines = np.array(rows_of(folder / "run.rrd", data_path("active-set", "multiplier"))["scalars"])
    batch = Batch(tuple(steps["active-set"]))
    rows = [row for row, limit in pair_rows(info).items() if limit == "obstacle"]
    np.testing.assert_array_equal(np.abs(lines[:, 0]), np.abs(batch.multiplier[:, rows]).max(axis=1))
    assert lines[:, 0].min() < 0.0


def test_events_and_summary_panel_say_how_near_it_was(folder, info, steps):
    """The closed form is reported below the margin; the panel has the least distance of each limit [mm]."""
    texts = [text[0] for text in rows_of(folder / "run.rrd", "/run/events")["text"]]
    assert "pinv: nearer than the margin of obstacle" in texts
    assert not any(text.startswith("active-set: nearer") for text in texts)
    panel = SummaryPanel(info, LimitGauge(info))
    for own in steps.values():
        panel.take(Batch(tuple(own)))
    text = panel.text("finished")
    least = min(step.distances["obstacle"].distance.min() for step in steps["active-set"])
    row = next(line for line in text.splitlines() if line.startswith("| active-set"))
    assert row.split("|")[5].strip() == f"{1e3 * least:.3g}"
    assert "obstacle, least [mm]" in text
    assert {"Distance: obstacle [m]", "Distance: itself [m]"} <= layout_words(folder / "run.rrd")


def test_the_table_names_the_nearest_pair(folder, info, steps):
    """Least distance and its pair, tick by tick, for each limit that keeps distances."""
    names = info.plan.distance_limits["obstacle"].row_names
    for row in read_table(folder).to_pylist():
        distance = steps[row["resolver"]][row["tick"]].distances["obstacle"].distance
        assert row["distance/obstacle"] == distance.min()
        assert row["nearest/obstacle"] == names[distance.argmin()]
        assert row["distance/itself"] > 0.0


def test_at_most_three_pairs_are_drawn_at_a_time():
    """The nearest three of those within the influence, and none beyond it."""
    distance = np.array([[0.5, 0.1, 0.2, -0.1, 0.3], [0.9, 0.9, 0.35, 0.9, 0.9], [1.0, 1.0, 1.0, 1.0, 1.0]])
    expected = [[False, True, True, True, False], [False, False, True, False, False], [False] * 5]
    assert nearest_pairs(distance, 0.4).tolist() == expected


def test_a_distance_a_millimetre_below_the_margin_is_seen(info, steps, tmp_path):
    """The planted fault turns its segment yellow, and enters the events."""
    step = steps["active-set"][0]
    distance, witness = step.distances["obstacle"]
    lie = Measured(distance - distance.min() + MARGIN - 1e-3, witness)
    log = BufferedRecorder(info, [RecordingSink(tmp_path / "run.rrd")])
    with log:
        log.write(replace(step, distances={**step.distances, "obstacle": lie}))
    assert rows_of(tmp_path / "run.rrd", f"{WORLD}/distance/obstacle")["colors"][0][0] == VIOLATED
    texts = [text[0] for text in rows_of(tmp_path / "run.rrd", "/run/events")["text"]]
    assert "active-set: nearer than the margin of obstacle" in texts


def test_an_obstacle_has_one_name_in_rows_scene_plots_and_events(near, tmp_path):
    """Of [ball, sphere, sphere] the spheres are "sphere" and "sphere 2" wherever a name is shown.

    The oracle numbers the spheres by hand; a second numbering anywhere would add or miss a name.
    """
    balls = [
        Sphere((0.85, -0.15, 0.0), 0.1, name="ball"),
        Sphere((0.85, -0.2, 0.0), 0.1),
        Sphere((0.8, -0.2, 0.0), 0.1),
    ]
    names = {"ball", "sphere", "sphere 2"}
    limits = [ObstacleLimit(balls, MARGIN, influence=INFLUENCE), JointVelocityLimit(velocity=6.0)]
    scenario = replace(near, stack=Stack(near.stack.levels, limits), name="spheres")
    info = RunInfo(scenario, ("active-set",))
    log = Log(info, tmp_path)
    with log:
        for step in run(scenario, resolver("active-set")):
            log.write(step)
    assert set(info.plan.obstacles) == names
    rows = {row.split(" – ")[1] for row in info.plan.distance_limits["obstacle"].row_names}
    assert rows == names
    known = entities(tmp_path / "run.rrd")
    scene = {path for path in known if path.startswith(f"{WORLD}/obstacle/")}
    assert scene == {f"{WORLD}/obstacle/{escaped_part(name)}" for name in names}
    plotted = {
        path for path in known if path.startswith(data_path("active-set", "distance", "obstacle") + "/")
    }
    pairs = info.plan.distance_limits["obstacle"].row_names
    assert plotted
    assert plotted <= {pair_path("active-set", "obstacle", pair) for pair in pairs}
    table = {row["nearest/obstacle"].split(" – ")[1] for row in read_table(tmp_path).to_pylist()}
    assert table <= names
    active = {
        name for row in read_table(tmp_path).to_pylist() for name in row["active"] if "obstacle/" in name
    }
    assert active
    assert {name.split(" – ")[1].rsplit(" ", 1)[0] for name in active} <= names


def test_two_limits_that_give_one_name_to_two_obstacles_are_told_apart(near):
    """Rows and scene number them alike; an obstacle of both limits has one name and is drawn once."""
    one, two = Sphere((0.0, 1.0, 0.0), 0.1), Sphere((0.0, 2.0, 0.0), 0.1)
    limits = [ObstacleLimit([one], name="near"), ObstacleLimit([two, one], name="far")]
    info = RunInfo(replace(near, stack=Stack(near.stack.levels, limits)), NAMES)
    assert info.plan.obstacles == {"sphere": one, "sphere 2": replace(two, name="sphere 2")}
    called = {
        name: [row.split(" – ")[1] for row in limit.row_names]
        for name, limit in info.plan.distance_limits.items()
    }
    assert set(called["near"]) == {"sphere"}
    assert called["far"][: len(called["near"])] == ["sphere 2"] * len(called["near"])
    assert set(called["far"]) == {"sphere", "sphere 2"}


def test_an_objective_names_its_obstacles_as_the_limits_do(near):
    """An obstacle that a limit and an objective share is one; another of the same name gets a number."""
    shared, other = Sphere((0.0, 1.0, 0.0), 0.1, name="pole"), Sphere((0.0, 2.0, 0.0), 0.1, name="pole")
    levels = [*near.stack.levels, [GradientTask(0.5 * ObstacleDistance([other, shared]))]]
    info = RunInfo(replace(near, stack=Stack(levels, [ObstacleLimit(shared)])), NAMES)
    assert info.plan.obstacles == {"pole": shared, "pole 2": replace(other, name="pole 2")}


def test_an_obstacle_needs_a_name_that_can_be_shown():
    """An empty one is refused when it is declared."""
    with pytest.raises(InvalidValue, match="name of an obstacle must be a word, got ''"):
        Sphere((0.0, 0.0, 0.0), 0.1, name="")
