"""The compiled copy of a tick writes the same rows as the copy in Python."""

import numpy as np
import pytest

from taskopt import Controller, JointPositionLimit, ObstacleLimit, PositionTask, Sphere, Stack, open_log
from taskopt.kinematics.objective import Manipulability
from taskopt.kinematics.target import Line
from taskopt.kinematics.task import GradientTask, JointTask
from taskopt.log import quick
from tests.log.conftest import ARM, DT, START, stack


def moving() -> Stack:
    """A stack with a pose, a task that Python fills, and an obstacle that moves; undamped, all ordinary."""
    hand = PositionTask("tip", target=Line(by=(0.2, 0.1, 0.0), duration=0.3), axes="xy", name="hand")
    ball = Sphere((1.5, 0.3, 0.0), 0.1, name="ball")
    near = ObstacleLimit(ball, moving={"ball": Line(by=(-0.3, 0.0, 0.0), duration=0.4)})
    levels = [[hand], [GradientTask(Manipulability("tip", axes="xy"))], [JointTask()]]
    return Stack(levels, [near], damping=None)


def rows(path, declared: Stack, compiled: bool, used: list[bool]) -> list[dict]:
    """Run a loop with one of the two copies; it is started again, and given velocities and other steps."""
    control = Controller(ARM, declared, dt=DT, log=path)
    logged = control._tick.__self__
    if compiled:
        add = logged._quick.add
        logged._quick.add = lambda *arguments: used.append(add(*arguments)) or used[-1]
    else:
        logged._quick.add = lambda *_: False
    q = START
    for k in range(60):
        if k == 30:
            control.start(q, k * DT)
        v = np.array([0.1, 0.0, -0.1]) if k in (10, 11, 31) else None
        q = ARM.integrate(q, control.step(q, k * DT, v, DT / 2 if k > 40 else None).v, DT)
    control.log.close()
    return open_log(path).table().drop(["clock"]).to_pylist()


@pytest.mark.slow
@pytest.mark.parametrize("declared", [stack, moving])
def test_both_copies_write_the_same_rows(tmp_path, declared):
    """Every number of every row is the same, whether it was copied by compiled code or by Python."""
    used: list[bool] = []
    one = rows(tmp_path / "a.arrow", declared(), True, used)
    other = rows(tmp_path / "b.arrow", declared(), False, used)
    assert used == [True] * 60
    for a, b in zip(one, other, strict=True):
        for name, value in a.items():
            np.testing.assert_array_equal(value, b[name], err_msg=name)
    assert [row["tick"] for row in one] == list(range(60))
    assert sum(row["v_before"] is not None for row in one) >= 3


@pytest.mark.slow
def test_a_copy_with_a_wrong_place_is_noticed(tmp_path, monkeypatch):
    """A part that is copied to the place of its neighbour gives other rows."""
    places = quick.offsets_of
    monkeypatch.setattr(quick, "offsets_of", lambda form: places(form) | {"errors": places(form)["q"]})
    one = rows(tmp_path / "a.arrow", stack(), True, [])
    other = rows(tmp_path / "b.arrow", stack(), False, [])
    assert one[20]["error/hand"] != other[20]["error/hand"]


@pytest.mark.slow
def test_a_task_that_keeps_its_error_in_another_array_is_logged_with_it(tmp_path):
    """A tick after an array was replaced is copied by Python, with the numbers of the new array."""
    path, errors, q = tmp_path / "a.arrow", [], START
    control = Controller(ARM, moving(), dt=DT, log=path)
    gradient = control.plan.tasks[1]
    for k in range(12):
        if k == 5:
            gradient.error = np.zeros_like(gradient.error)
        q = ARM.integrate(q, control.step(q, k * DT).v, DT)
        errors.append(gradient.error.copy())
    control.log.close()
    logged = open_log(path)
    np.testing.assert_array_equal(logged.array(f"error/{gradient.name}"), errors)
    assert len({tuple(error) for error in errors}) == 12


@pytest.mark.slow
def test_ticks_after_a_log_is_closed_are_resolved_without_it(tmp_path):
    """A loop goes on when its log is closed, and the file has the ticks from before."""
    control = Controller(ARM, Stack([[JointTask()]], [JointPositionLimit()]), dt=DT, log=tmp_path / "a.arrow")
    q = control.step(START, 0.0).v
    control.log.close()
    assert control.step(START + DT * q, DT).claimed
    assert len(open_log(tmp_path / "a.arrow")) == 1
