"""Distances between solids at a configuration: between links and obstacles, and among links.

The one place for distances; limits and objectives stand on it. Read it in this order:

    pairs        which shapes can meet, and what they are called
    model        `Collision`: pairs of convex solids, measured by Coal in memory that kernels can read
    measure      `Distances`: signed distances and their gradients ∂d/∂q
    step_bounds  how much a distance can change in one step of a robot

The solids themselves, obstacles among them, are in `taskopt.kinematics.geometry`.
"""
