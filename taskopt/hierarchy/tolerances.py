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

# --- Control loop and run -----------------------------------------------------------------------------

CLAIM_KEEPS_LIMITS = 1e-6
"""Largest primal residual (relative, see `Certificate`) of a claimed optimum that may be sent to a robot.

Smaller: a loop stops at answers of solvers that work to 1e-7, though nothing is wrong with them. Larger: a
velocity that visibly leaves a hard limit is sent because somebody claims that it is the optimum.
"""

STOPPED_KEEPS_LIMITS = 1e-8
"""As CLAIM_KEEPS_LIMITS, for an answer with which a solver stopped at its limit of iterations.

Such an answer has no claim in its favour, so its limits must hold as well as those of a proven one.
"""

CLOSED_FORM_INSIDE = 1e-12
"""How far a closed-form answer may be outside a bound, relative to max(1, |bound|), and still keep it.

Smaller: rounding makes "nothing binds" false where the optimum is the closed form. Larger: ticks are counted
at which a limit binds a little, and their distance to the closed form is not rounding.
"""
