"""Parts of a robot, as every reader makes them; joints can be locked in them."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin
from typing_extensions import TypeAliasType

from taskopt.arrays import Array
from taskopt.kinematics.engine import GeometryModel, Model

Shapes = TypeAliasType("Shapes", GeometryModel | Callable[[], GeometryModel] | None)
"""Shapes, or a function that loads them on first use, or None for no shapes."""


@dataclass(frozen=True)
class Parts:
    """Tree, shapes and named postures of a robot.

    Attributes:
        model: The kinematic tree.
        geometry: Collision shapes, or a function that loads them.
        visual: Shapes to draw, or a function that loads them; None: the collision shapes.
        name: Name of the robot.
        postures: Named configurations (nq,) [rad, m].
    """

    model: Model
    geometry: Shapes = None
    visual: Shapes = None
    name: str = "robot"
    postures: Mapping[str, Array] = field(default_factory=dict)

    def locked(self, ids: Sequence[int], q: Array) -> "Parts":
        """Make the parts of a robot in which some joints are fixed.

        Args:
            ids: Pinocchio's indices of the joints to fix.
            q: Configuration (nq,) [rad, m] at which they are held.

        Returns:
            New parts; shapes are still loaded on first use only.
        """

        def reduced(shapes: Shapes) -> Callable[[], GeometryModel]:
            return lambda: pin.buildReducedModel(self.model, self._with_frames(shapes), list(ids), q)[1]

        return Parts(
            pin.buildReducedModel(self.model, list(ids), q),
            reduced(self.geometry),
            None if self.visual is None else reduced(self.visual),
            self.name,
            {name: self._kept(posture, ids) for name, posture in self.postures.items()},
        )

    def _with_frames(self, shapes: Shapes) -> GeometryModel:
        """Copy the shapes, and give each a parent frame; Pinocchio crashes on shapes without one."""
        model = pin.GeometryModel(loaded(shapes))
        for shape in model.geometryObjects:
            if shape.parentFrame >= self.model.nframes:
                shape.parentFrame = self.model.getFrameId(self.model.names[shape.parentJoint])
        return model

    def _kept(self, q: Array, ids: Sequence[int]) -> Array:
        """Return the part of a configuration that belongs to the joints that are not fixed."""
        joints = [joint for i, joint in enumerate(self.model.joints) if i > 0 and i not in ids]
        return np.concatenate([np.empty(0), *(q[j.idx_q : j.idx_q + j.nq] for j in joints)])


def loaded(shapes: Shapes) -> GeometryModel:
    """Load shapes if they are not loaded yet.

    Args:
        shapes: The shapes, a function that loads them, or None.

    Returns:
        The shapes (`pin.GeometryModel`); an empty model for None.
    """
    if shapes is None:
        return pin.GeometryModel()
    return shapes() if callable(shapes) else shapes
