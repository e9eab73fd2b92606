"""Every tolerance of the package, in one table: what it decides, and what another value would do.

Tolerances are plain numbers, since compiled kernels read them as constants. Counts, such as how often a
search may be repeated, stand where they are used.
"""

# --- Proof of an answer -------------------------------------------------------------------------------

PROVEN = 1e-8
"""Largest KKT residual (relative, see `Certificate`) with which an answer counts as proven.

Smaller: right answers of interior-point and augmented-Lagrangian solvers are refused, since they stop near
1e-9. Larger: errors of that relative size in x pass as proven.
"""
