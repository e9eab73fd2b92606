"""Limits that a `pin.Model` states and no stack holds, since they are not those of a single velocity."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

import numpy as np

from taskopt.arrays import NO_BOUND
from taskopt.kinematics.engine import Model

_LINEAR = {
    "JointModelPlanar": "xy",
    "JointModelFreeFlyer": "xyz",
}  # coordinates whose rates turn with the body
_NO_LIMIT = 1.01  # [m] what Pinocchio's readers write, besides inf, where a file states no limit


def unheld_limits(model: Model) -> tuple[str, ...]:
    """Name the position limits of planar and floating joints.

    Their positions are coordinates of the parent, and their velocities stand in the joint's own frame, so
    that no bound of a single velocity holds such a limit.

    Args:
        model: The kinematic tree.

    Returns:
        One sentence for each joint with such a limit.
    """
    said = []
    for name, joint in list(zip(model.names, model.joints, strict=True))[1:]:
        letters = _LINEAR.get(joint.shortname(), "")
        places = slice(joint.idx_q, joint.idx_q + len(letters))
        stated = np.zeros(len(letters), dtype=bool)
        for limit in (model.lowerPositionLimit[places], model.upperPositionLimit[places]):
            stated |= (np.abs(limit) < NO_BOUND) & (np.abs(limit) != _NO_LIMIT)
        if stated.any():
            which = ", ".join(letter for letter, is_stated in zip(letters, stated, strict=True) if is_stated)
            said.append(
                f"joint {name}: the position limits of {which} are not held; BoxTask keeps a frame in a box"
            )
    return tuple(said)
