"""What a robot is made from, whatever it was read from; joints can be locked in it."""

# Pinocchio and Coal ship no stubs.
# pyright: reportAttributeAccessIssue=false

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pinocchio as pin

from taskopt.arrays import Array

Shapes = Any  # a pin.GeometryModel, None, or a function that loads one on first use


@dataclass(frozen=True)
class Parts:
    """Tree, shapes and named postures (nq,)."""

    model: Any
    geometry: Shapes = None
    visual: Shapes = None
    name: str = "robot"
    postures: Mapping[str, Array] = field(default_factory=dict)

    def locked(self, ids: Sequence[int], q: Array) -> "Parts":
        """The parts with the joints `ids` held where q has them."""

        def reduced(shapes: Shapes) -> Callable[[], Any]:
            return lambda: pin.buildReducedModel(self.model, self._with_frames(shapes), list(ids), q)[1]

        return Parts(
            pin.buildReducedModel(self.model, list(ids), q),
            reduced(self.geometry),
            None if self.visual is None else reduced(self.visual),
            self.name,
            {name: self._kept(posture, ids) for name, posture in self.postures.items()},
        )

    def _with_frames(self, shapes: Shapes) -> Any:
        """The shapes, each with a parent frame: Pinocchio crashes on the ones built without."""
        model = pin.GeometryModel(loaded(shapes))
        for shape in model.geometryObjects:
            if shape.parentFrame >= self.model.nframes:
                shape.parentFrame = self.model.getFrameId(self.model.names[shape.parentJoint])
        return model

    def _kept(self, q: Array, ids: Sequence[int]) -> Array:
        """The part of q that belongs to the joints that stay."""
        joints = [joint for i, joint in enumerate(self.model.joints) if i > 0 and i not in ids]
        return np.concatenate([np.empty(0), *(q[j.idx_q : j.idx_q + j.nq] for j in joints)])


def loaded(shapes: Shapes) -> Any:
    """The pin.GeometryModel itself; an empty one for None."""
    if shapes is None:
        return pin.GeometryModel()
    return shapes() if callable(shapes) else shapes
