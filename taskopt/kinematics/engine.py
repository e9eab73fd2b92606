"""Names for the types of Pinocchio and Coal, which ship no type stubs.

A type checker sees `Any`, while signatures and `help()` show the name of the type. Only `robot`,
`configuration`, `geometry` and `collision` use objects of these types.
"""

from typing import Any

from typing_extensions import TypeAliasType

Model = TypeAliasType("Model", Any)
"""`pinocchio.Model`: kinematic tree, joints, frames, inertias, limits."""

Data = TypeAliasType("Data", Any)
"""`pinocchio.Data`: joint poses and Jacobians at one configuration."""

JointModel = TypeAliasType("JointModel", Any)
"""`pinocchio.JointModel`: one joint of a model."""

GeometryModel = TypeAliasType("GeometryModel", Any)
"""`pinocchio.GeometryModel`: shapes fixed to joints, and pairs of them."""

GeometryObject = TypeAliasType("GeometryObject", Any)
"""`pinocchio.GeometryObject`: one shape, with its place in the frame of its joint."""

GeometryData = TypeAliasType("GeometryData", Any)
"""`pinocchio.GeometryData`: requests and results of distance computations."""

CoalShape = TypeAliasType("CoalShape", Any)
"""`coal.CollisionGeometry`: a shape without a place."""
