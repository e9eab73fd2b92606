"""Distances between solids at a configuration: between links and obstacles, and among links.

All limits and objectives on distances use this package. Read its modules in this order:

    pairs        shapes by the names of their links
    choice       which pairs of shapes of a robot are kept apart, and why not all
    lengths      how far the joints can be from each other
    always_near  pairs that are near each other in every posture
    model        `Collision`: pairs of convex solids, measured by Coal in memory that kernels can read
    measure      `Distances`: signed distances and their gradients ∂d/∂q
    step_bounds  how much a distance can change in one step of a robot

The solids themselves, obstacles among them, are in `taskopt.kinematics.geometry`.
"""
