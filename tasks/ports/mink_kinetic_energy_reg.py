"""A UR5 draws a figure of eight with little kinetic energy, as in `kinetic_energy_reg.py` of mink.

The energy has no task above it there and a weight of 0 to 1e-5 beside the position; here it decides what the
position leaves, so that it costs no accuracy.
"""

import numpy as np

from taskopt import (
    Function,
    JointPositionLimit,
    JointVelocityLimit,
    KineticEnergyTask,
    PositionTask,
    Robot,
    Scenario,
    Stack,
)

dt = 2e-2
eight = Function(lambda t: np.array([0.5 + 0.1 * np.sin(2.0 * t), 0.2 * np.sin(t), 0.25]))  # [m]

scenario = Scenario(
    robot=Robot.load("ur5_robot"),
    q0=[0.0, -np.pi / 2, np.pi / 2, -np.pi / 2, -np.pi / 2, 0.0],
    stack=Stack(
        levels=[[PositionTask("ee_link", target=eight, gain=1.0 / dt)], [KineticEnergyTask()]],
        limits=[JointPositionLimit(), JointVelocityLimit()],
    ),
    duration=6.3,
    dt=dt,
)
