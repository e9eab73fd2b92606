"""Compiled kernels of SO(3) and SE(3): logarithm, exponential, and their derivatives.

Conventions are those of `taskopt.kinematics.pose`: linear part [m] first, then angular [rad], both in the
body frame. With θ = ‖ω‖ all maps are built from three scalars that are even functions of θ: α = (θ/2)
cot(θ/2), β = (1 − α)/θ² and γ = β'(θ)/θ. Results are written into the array `out`, and nothing is allocated,
so that kernels of tasks can call these functions on every tick. The symbols of the arguments are

    R    (3, 3) rotation matrix; a pose (4, 4) may stand in its place
    T    (4, 4) pose, translation in [m]
    ω    (3,) rotation vector [rad], as wx, wy, wz where the numbers come one by one

Source: Solà, Deray and Atchuthan (2018), arXiv:1812.01537, appendices B (SO(3)) and D (SE(3)).
"""

import math

from taskopt.hierarchy.tolerances import NO_ANGLE, SERIES_BELOW
from taskopt.jit import kernel


@kernel
def _quaternion(R):
    """Compute the unit quaternion (w, x, y, z) of R, with w ≥ 0.

    It is built from the largest of its four components, so that no digit is lost near angles of 0 and π.

    Source:
        Shepperd (1978), J. Guidance and Control 1(3).
    """
    a, b, c = R[0, 0], R[1, 1], R[2, 2]
    trace = a + b + c
    if trace > max(a, b, c):
        w, x, y, z = 1.0 + trace, R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    elif a >= b and a >= c:
        w, x, y, z = R[2, 1] - R[1, 2], 1.0 + a - b - c, R[1, 0] + R[0, 1], R[0, 2] + R[2, 0]
    elif b >= c:
        w, x, y, z = R[0, 2] - R[2, 0], R[1, 0] + R[0, 1], 1.0 + b - c - a, R[2, 1] + R[1, 2]
    else:
        w, x, y, z = R[1, 0] - R[0, 1], R[0, 2] + R[2, 0], R[2, 1] + R[1, 2], 1.0 + c - a - b
    norm = math.copysign(math.sqrt(w * w + x * x + y * y + z * z), w)
    return w / norm, x / norm, y / norm, z / norm


@kernel
def _log_terms(R):
    """Compute ω, α, β and γ of a rotation.

    Where θ is exactly π, both ω and −ω are logarithms; the one with its largest component positive is chosen.
    """
    w, x, y, z = _quaternion(R)
    s2 = x * x + y * y + z * z
    s = math.sqrt(s2)
    if s < NO_ANGLE:  # θ/s = 2 to the last bit, and s = 0 must not divide
        return 2.0 * x, 2.0 * y, 2.0 * z, 1.0, 1.0 / 12.0, 1.0 / 360.0
    theta = 2.0 * math.atan2(s, w)
    t2 = theta * theta
    scale = theta / s
    if theta < SERIES_BELOW:
        beta, gamma = _beta_series(t2), _gamma_series(t2)
        alpha = 1.0 - t2 * beta
    else:
        alpha = 0.5 * theta * w / s
        beta = (1.0 - alpha) / t2
        gamma = (alpha + 0.25 * t2 / s2 - 2.0) / (t2 * t2)
    return scale * x, scale * y, scale * z, alpha, beta, gamma


@kernel
def _beta_series(t2):
    """Compute β = Σ |B₂ₖ| θ²ᵏ⁻² / (2k)! over k ≥ 1, with the Bernoulli numbers B₂ₖ, from t2 = θ²."""
    s = 1.0 / 74724249600.0
    s = s * t2 + 691.0 / 1307674368000.0
    s = s * t2 + 1.0 / 47900160.0
    s = s * t2 + 1.0 / 1209600.0
    s = s * t2 + 1.0 / 30240.0
    s = s * t2 + 1.0 / 720.0
    return s * t2 + 1.0 / 12.0


@kernel
def _gamma_series(t2):
    """Compute γ from t2 = θ²: the series of β, differentiated and divided by θ."""
    s = 12.0 / 74724249600.0
    s = s * t2 + 6910.0 / 1307674368000.0
    s = s * t2 + 8.0 / 47900160.0
    s = s * t2 + 6.0 / 1209600.0
    s = s * t2 + 4.0 / 30240.0
    return s * t2 + 2.0 / 720.0


@kernel
def log3_into(R, out):
    """Compute the rotation vector of a rotation, R = exp3(ω), with angle in [0, π].

    Args:
        R: (3, 3) rotation matrix.
        out: (3,) receives ω [rad].

    Source:
        Solà et al. (2018), appendix B, logarithm of SO(3).
    """
    out[0], out[1], out[2], _, _, _ = _log_terms(R)


@kernel
def log6_into(T, out):
    """Compute the body twist ξ = (v, ω) of a pose, T = exp6(ξ): ω = log3(R), v = α p − ½ ω×p + β (ωᵀp) ω.

    Args:
        T: (4, 4) pose with rotation R and translation p [m].
        out: (6,) receives ξ, v [m] then ω [rad], in the body frame.

    Source:
        Solà et al. (2018), appendix D, logarithm of SE(3), with V⁻¹ written out.
    """
    wx, wy, wz, alpha, beta, _ = _log_terms(T)
    _log_of_terms(T, wx, wy, wz, alpha, beta, out)


@kernel
def _log_of_terms(T, wx, wy, wz, alpha, beta, out):
    """Write the logarithm of a pose into `out` (6,), from what `_log_terms` returned for it."""
    px, py, pz = T[0, 3], T[1, 3], T[2, 3]
    along = beta * (wx * px + wy * py + wz * pz)
    out[0] = alpha * px - 0.5 * (wy * pz - wz * py) + along * wx
    out[1] = alpha * py - 0.5 * (wz * px - wx * pz) + along * wy
    out[2] = alpha * pz - 0.5 * (wx * py - wy * px) + along * wz
    out[3], out[4], out[5] = wx, wy, wz


@kernel
def _jlog3_of_terms(wx, wy, wz, alpha, beta, out):
    """Write α I + ½ [ω]× + β ω ωᵀ, the inverse right Jacobian of SO(3), into the upper left of `out`."""
    out[0, 0], out[1, 1], out[2, 2] = alpha + beta * wx * wx, alpha + beta * wy * wy, alpha + beta * wz * wz
    xy, xz, yz = beta * wx * wy, beta * wx * wz, beta * wy * wz
    hx, hy, hz = 0.5 * wx, 0.5 * wy, 0.5 * wz
    out[0, 1], out[1, 0] = xy - hz, xy + hz
    out[0, 2], out[2, 0] = xz + hy, xz - hy
    out[1, 2], out[2, 1] = yz - hx, yz + hx


@kernel
def jlog3_into(R, out):
    """Write the inverse right Jacobian of SO(3) into an array; see `pose.jlog3`.

    Args:
        R: (3, 3) rotation matrix.
        out: (3, 3) receives the matrix. If the array is larger, its upper left part is written.

    Source:
        Solà et al. (2018), appendix B, inverse of the right Jacobian.
    """
    wx, wy, wz, alpha, beta, _ = _log_terms(R)
    _jlog3_of_terms(wx, wy, wz, alpha, beta, out)


@kernel
def _jlog6_of_terms(T, wx, wy, wz, alpha, beta, gamma, out):
    """Write [[A, C A], [0, A]], the inverse right Jacobian of SE(3), into `out` (6, 6).

    A is jlog3(R), and C the derivative of v = α p − ½ ω×p + β (ωᵀp) ω along ω. The scalars are those that
    `_log_terms` returned for the pose.
    """
    _jlog3_of_terms(wx, wy, wz, alpha, beta, out)
    w, p = (wx, wy, wz), (T[0, 3], T[1, 3], T[2, 3])
    dot = wx * p[0] + wy * p[1] + wz * p[2]
    toward_p = gamma * (wx * wx + wy * wy + wz * wz) + 2.0 * beta
    half = (0.5 * p[0], 0.5 * p[1], 0.5 * p[2])
    skew = ((0.0, -half[2], half[1]), (half[2], 0.0, -half[0]), (-half[1], half[0], 0.0))
    for i in range(3):
        u = gamma * dot * w[i] - toward_p * p[i]
        c0 = u * w[0] + beta * w[i] * p[0] + skew[i][0]
        c1 = u * w[1] + beta * w[i] * p[1] + skew[i][1]
        c2 = u * w[2] + beta * w[i] * p[2] + skew[i][2]
        for j in range(3):
            ca = c0 * out[0, j] + c1 * out[1, j] + c2 * out[2, j]
            out[i, 3 + j] = ca + beta * dot * out[i, j]
    for i in range(3):
        for j in range(3):
            out[3 + i, 3 + j] = out[i, j]
            out[3 + i, j] = 0.0


@kernel
def jlog6_into(T, out):
    """Write the inverse right Jacobian of SE(3) into an array; see `pose.jlog6`.

    Args:
        T: (4, 4) pose.
        out: (6, 6) receives the matrix, for body twists (linear [m], angular [rad]).

    Source:
        Solà et al. (2018), appendix D, inverse of the right Jacobian.
    """
    wx, wy, wz, alpha, beta, gamma = _log_terms(T)
    _jlog6_of_terms(T, wx, wy, wz, alpha, beta, gamma, out)


@kernel
def log6_jlog6_into(T, log, jlog):
    """Compute logarithm and inverse right Jacobian of a pose at once, at half the cost of two calls.

    Args:
        T: (4, 4) pose.
        log: (6,) receives ξ as from `log6_into`.
        jlog: (6, 6) receives the matrix as from `jlog6_into`.

    Source:
        Solà et al. (2018), appendix D.
    """
    wx, wy, wz, alpha, beta, gamma = _log_terms(T)
    _log_of_terms(T, wx, wy, wz, alpha, beta, log)
    _jlog6_of_terms(T, wx, wy, wz, alpha, beta, gamma, jlog)


@kernel
def exp_terms(theta):
    """Compute the three scalars of which exponentials are made.

    Args:
        theta: Angle θ ≥ 0 [rad].

    Returns:
        (sin θ)/θ, (1 − cos θ)/θ² and (θ − sin θ)/θ³.
    """
    t2 = theta * theta
    if theta > SERIES_BELOW:
        half = math.sin(0.5 * theta)
        s = math.sin(theta) / theta
        return s, 2.0 * half * half / t2, (1.0 - s) / t2
    a = b = c = 0.0
    for k in range(8, -1, -1):  # Horner: 1/(2k + 1)!, 1/(2k + 2)!, 1/(2k + 3)! with alternating sign
        n = 2.0 * k
        a = 1.0 - a * t2 / ((n + 2.0) * (n + 3.0))
        b = 1.0 - b * t2 / ((n + 3.0) * (n + 4.0))
        c = 1.0 - c * t2 / ((n + 4.0) * (n + 5.0))
    return a, b / 2.0, c / 6.0


@kernel
def exp3_into(omega, out):
    """Compute the rotation matrix of a rotation vector (Rodrigues' formula).

    Args:
        omega: (3,) [rad], axis times angle.
        out: (3, 3) receives the rotation. If the array is larger, its upper left part is written.

    Source:
        Solà et al. (2018), appendix B, exponential of SO(3).
    """
    x, y, z = omega[0], omega[1], omega[2]
    a, b, _ = exp_terms(math.sqrt(x * x + y * y + z * z))
    xx, yy, zz = b * x * x, b * y * y, b * z * z
    out[0, 0], out[1, 1], out[2, 2] = 1.0 - yy - zz, 1.0 - xx - zz, 1.0 - xx - yy
    out[0, 1], out[1, 0] = b * x * y - a * z, b * x * y + a * z
    out[0, 2], out[2, 0] = b * x * z + a * y, b * x * z - a * y
    out[1, 2], out[2, 1] = b * y * z - a * x, b * y * z + a * x


@kernel
def exp6_into(twist, out):
    """Write the pose exp6(ξ) of a body twist into an array; see `pose.exp6`.

    Args:
        twist: (6,), linear [m] then angular [rad], in the body frame.
        out: (4, 4) receives the pose.

    Source:
        Solà et al. (2018), appendix D, exponential of SE(3), with V written out.
    """
    exp3_into(twist[3:], out)
    vx, vy, vz, x, y, z = twist[0], twist[1], twist[2], twist[3], twist[4], twist[5]
    a, b, c = exp_terms(math.sqrt(x * x + y * y + z * z))
    along = c * (x * vx + y * vy + z * vz)
    out[0, 3] = a * vx + b * (y * vz - z * vy) + along * x
    out[1, 3] = a * vy + b * (z * vx - x * vz) + along * y
    out[2, 3] = a * vz + b * (x * vy - y * vx) + along * z
    out[3, 0] = out[3, 1] = out[3, 2] = 0.0
    out[3, 3] = 1.0


@kernel
def relative_into(A, B, out):
    """Compute A⁻¹ B, the pose of the frame B seen from the frame A.

    Args:
        A: (4, 4) pose in the world.
        B: (4, 4) pose in the world.
        out: (4, 4) receives the pose; must be neither A nor B.
    """
    for i in range(3):
        for j in range(3):
            out[i, j] = A[0, i] * B[0, j] + A[1, i] * B[1, j] + A[2, i] * B[2, j]
        dx, dy, dz = B[0, 3] - A[0, 3], B[1, 3] - A[1, 3], B[2, 3] - A[2, 3]
        out[i, 3] = A[0, i] * dx + A[1, i] * dy + A[2, i] * dz
    out[3, 0] = out[3, 1] = out[3, 2] = 0.0
    out[3, 3] = 1.0


@kernel
def turned_back(T, x):
    """Compute Rᵀ x.

    Args:
        T: (4, 4) pose, or (3, 3) rotation; R is its rotation.
        x: Three numbers.

    Returns:
        Three numbers.
    """
    return (
        T[0, 0] * x[0] + T[1, 0] * x[1] + T[2, 0] * x[2],
        T[0, 1] * x[0] + T[1, 1] * x[1] + T[2, 1] * x[2],
        T[0, 2] * x[0] + T[1, 2] * x[1] + T[2, 2] * x[2],
    )
