"""Central differences on the manifold."""

from collections.abc import Callable

import numpy as np

from taskopt.arrays import Array
from taskopt.kinematics.configuration import Configuration

STEP = 1e-5  # the error of a central difference is about STEP² + 1e-16 / STEP, near 1e-10


def derivative(function: Callable[[Configuration], Array | float], at: Configuration) -> Array:
    """∂f/∂q: the shape of f, then nv."""
    arm = at.robot
    columns = []
    for step in np.eye(arm.nv) * STEP:
        ahead = np.asarray(function(Configuration(arm, arm.integrate(at.q, step, 1.0))))
        behind = np.asarray(function(Configuration(arm, arm.integrate(at.q, step, -1.0))))
        columns.append((ahead - behind) / (2.0 * STEP))
    return np.stack(columns, axis=-1)
