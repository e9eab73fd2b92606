"""Control loops that are logged, with the answers that they got."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from taskopt import (
    Controller,
    JointAccelerationLimit,
    JointPositionLimit,
    JointTask,
    JointVelocityLimit,
    Log,
    PositionTask,
    Resolution,
    RestDamping,
    Stack,
    open_log,
    planar_arm,
)
from taskopt.errors import TaskoptError

DT = 5e-3
ARM = planar_arm([0.5, 0.4, 0.3], lower=-3.0, upper=3.0)
FAR = (2.0, 0.3, 0.0)  # out of reach
START = np.array([0.3, 0.8, -0.5])


class Ran(NamedTuple):
    """A loop that was logged: its controller, its answers, its postures, and the log."""

    control: Controller
    answers: list[Resolution]
    postures: list[np.ndarray]
    log: Log


def stack(target=(0.2, 0.9, 0.0), *, norm=None, damping=None, acceleration=8.0) -> Stack:
    """A hand that goes for a target within limits on velocity and acceleration, which bind on the way."""
    hand = PositionTask("tip", target=target, gain=10.0, axes="xy", name="hand")
    limits = [JointPositionLimit(), JointVelocityLimit(velocity=0.9)]
    limits += [JointAccelerationLimit(acceleration)] if acceleration else []
    return Stack([[hand], [JointTask(gain=1.0, name="posture")]], limits, norm=norm, damping=damping)


def run(path: Path, declared: Stack, resolver="active-set", ticks=80, policy="raise", on_tick=None) -> Ran:
    """Run a loop into a log, until it ends or raises an error of taskopt."""
    control = Controller(ARM, declared, resolver, DT, policy, log=path)
    answers, postures, q = [], [], START
    try:
        for k in range(ticks):
            if on_tick is not None:
                on_tick(control, k)
            postures.append(q)
            answers.append(control.step(q, k * DT))
            q = ARM.integrate(q, answers[-1].v, DT)
    except TaskoptError:
        pass
    finally:
        control.log.close()
    return Ran(control, answers, postures, open_log(path))


@pytest.fixture(scope="session")
def logged(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Ran]:
    """Return the loop of a kind, which is run once."""
    folder, kept = tmp_path_factory.mktemp("logs"), {}
    norm = np.array([[2.0, 0.5, 0.0], [0.5, 3.0, 0.1], [0.0, 0.1, 1.0]])
    kinds = {
        "active-set": {"declared": stack()},
        "hqp/daqp": {"declared": stack(), "resolver": "hqp/daqp"},
        "wqp/proxqp": {"declared": stack(), "resolver": "wqp/proxqp"},
        "pinv": {"declared": stack(), "resolver": "pinv"},
        "full norm": {"declared": stack(norm=norm)},
        "damped": {
            "declared": stack((2.0, 0.3, 0.0), damping=RestDamping(), acceleration=None),
            "ticks": 500,
        },
    }

    def of(kind: str) -> Ran:
        if kind not in kept:
            kept[kind] = run(folder / f"{kind.replace('/', '-')}.arrow", **kinds[kind])
        return kept[kind]

    return of
