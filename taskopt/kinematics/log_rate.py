"""The rate of Jlog6 along a motion, which the errors of poses and orientations need at second order.

With s = θ², the square of the angle, the inverse right Jacobian of SE(3) is a polynomial of ad(ξ),

    Jlog6(ξ) = I + ½ ad(ξ) + a(s) ad(ξ)² + c(s) ad(ξ)⁴,    a = β − s β',    c = −β',

where β(s) = Σ b_k sᵏ⁻¹ over k ≥ 1 is the function of `taskopt.kinematics.lie`, with the coefficients
b_k = |B₂ₖ|/(2k)! = 2 ζ(2k)/(2π)²ᵏ of Bernoulli, and β' its derivative by s. The series converges for θ < 2π;
up to θ = π each term is at most a quarter of the one before. All functions are smooth at θ = 0 and θ = π.

Source:
    The polynomial: Bullo and Murray (1995), European Control Conference, "Proportional derivative (PD)
    control on the Euclidean group"; it follows from the series of Bernoulli and ad⁵ = −2 s ad³ − s² ad.
"""

import math

import numpy as np

from taskopt.jit import kernel

_TERMS = 34  # (1/4)³⁴ is below 1e-20
_SUMMED = 3000  # ζ(6) − Σ n⁻⁶ is then below 1e-18


def _coefficients() -> tuple[float, ...]:
    """Return b_1, b_2, …; the first two are exact fractions, the others sums of ζ."""
    n = np.arange(_SUMMED, 0, -1, dtype=np.float64)
    rest = (2.0 * float((n ** (-2.0 * k)).sum()) / (2.0 * math.pi) ** (2 * k) for k in range(3, _TERMS + 1))
    return (1.0 / 12.0, 1.0 / 720.0, *rest)


_B = _coefficients()


@kernel
def _beta_terms(s):
    """Compute β, β' and β'' at s = θ² by Horner's rule."""
    beta = first = second = 0.0
    for k in range(_TERMS - 1, -1, -1):
        second = second * s + 2.0 * first
        first = first * s + beta
        beta = beta * s + _B[k]
    return beta, first, second


@kernel
def _bracket(x, y):
    """Compute ad(x) y = (ω × v' + v × ω', ω × ω') of two twists (v, ω) and (v', ω'), as six numbers."""
    return (
        x[4] * y[2] - x[5] * y[1] + x[1] * y[5] - x[2] * y[4],
        x[5] * y[0] - x[3] * y[2] + x[2] * y[3] - x[0] * y[5],
        x[3] * y[1] - x[4] * y[0] + x[0] * y[4] - x[1] * y[3],
        x[4] * y[5] - x[5] * y[4],
        x[5] * y[3] - x[3] * y[5],
        x[3] * y[4] - x[4] * y[3],
    )


@kernel
def _plus(x, y):
    """Compute x + y of two twists."""
    return x[0] + y[0], x[1] + y[1], x[2] + y[2], x[3] + y[3], x[4] + y[4], x[5] + y[5]


@kernel
def jlog6_rate(xi, rate, u):
    """Compute the derivative of Jlog6(ξ) u along ξ̇, with u held.

    Args:
        xi: ξ, six numbers: linear [m], then angular [rad] of length below 2π.
        rate: ξ̇, six numbers.
        u: Any twist, six numbers.

    Returns:
        (d/dt Jlog6(ξ)) u, six numbers.

    Source:
        See the module.
    """
    s = xi[3] * xi[3] + xi[4] * xi[4] + xi[5] * xi[5]
    ds = 2.0 * (xi[3] * rate[3] + xi[4] * rate[4] + xi[5] * rate[5])
    beta, first, second = _beta_terms(s)
    one = _bracket(xi, u)
    two = _bracket(xi, one)
    three = _bracket(xi, two)
    four = _bracket(xi, three)
    d_one = _bracket(rate, u)
    d_two = _plus(_bracket(rate, one), _bracket(xi, d_one))
    d_three = _plus(_bracket(rate, two), _bracket(xi, d_two))
    d_four = _plus(_bracket(rate, three), _bracket(xi, d_three))
    a, c, da, dc = beta - s * first, -first, -s * second * ds, -second * ds
    return (
        0.5 * d_one[0] + da * two[0] + a * d_two[0] + dc * four[0] + c * d_four[0],
        0.5 * d_one[1] + da * two[1] + a * d_two[1] + dc * four[1] + c * d_four[1],
        0.5 * d_one[2] + da * two[2] + a * d_two[2] + dc * four[2] + c * d_four[2],
        0.5 * d_one[3] + da * two[3] + a * d_two[3] + dc * four[3] + c * d_four[3],
        0.5 * d_one[4] + da * two[4] + a * d_two[4] + dc * four[4] + c * d_four[4],
        0.5 * d_one[5] + da * two[5] + a * d_two[5] + dc * four[5] + c * d_four[5],
    )
