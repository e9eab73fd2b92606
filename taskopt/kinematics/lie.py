"""Kernels of SO(3) and SE(3): logarithm, exponential, and their rates, into arrays given.

Conventions are those of `taskopt.kinematics.pose`. With θ = ‖ω‖ all maps are built from scalars that are even
in θ: α = (θ/2) cot(θ/2), β = (1 − α)/θ² and γ = β'(θ)/θ. Solà, Deray and Atchuthan (2018),
arXiv:1812.01537. Nothing is allocated, so task kernels may call these on every tick.
"""

import math

from taskopt.jit import kernel

_SERIES_BELOW = 0.5  # [rad] below it differences like 1 − α cancel; the series is exact to the last bit


@kernel
def _quaternion(R):
    """(w, x, y, z) with w ≥ 0; built from the largest of the four, so that no digit is lost at 0 or π.

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
    """ω, α, β, γ of a rotation; at θ = π exactly, the axis has its largest component positive."""
    w, x, y, z = _quaternion(R)
    s2 = x * x + y * y + z * z
    s = math.sqrt(s2)
    if s < 1e-8:  # θ/s = 2 to the last bit; s = 0 must not divide
        return 2.0 * x, 2.0 * y, 2.0 * z, 1.0, 1.0 / 12.0, 1.0 / 360.0
    theta = 2.0 * math.atan2(s, w)
    t2 = theta * theta
    scale = theta / s
    if theta < _SERIES_BELOW:
        beta, gamma = _beta_series(t2), _gamma_series(t2)
        alpha = 1.0 - t2 * beta
    else:
        alpha = 0.5 * theta * w / s
        beta = (1.0 - alpha) / t2
        gamma = (alpha + 0.25 * t2 / s2 - 2.0) / (t2 * t2)
    return scale * x, scale * y, scale * z, alpha, beta, gamma


@kernel
def _beta_series(t2):
    """Σ |B₂ₖ| θ²ᵏ⁻² / (2k)! with the Bernoulli numbers B₂ₖ."""
    s = 1.0 / 74724249600.0
    s = s * t2 + 691.0 / 1307674368000.0
    s = s * t2 + 1.0 / 47900160.0
    s = s * t2 + 1.0 / 1209600.0
    s = s * t2 + 1.0 / 30240.0
    s = s * t2 + 1.0 / 720.0
    return s * t2 + 1.0 / 12.0


@kernel
def _gamma_series(t2):
    """The series of β, differentiated and divided by θ."""
    s = 12.0 / 74724249600.0
    s = s * t2 + 6910.0 / 1307674368000.0
    s = s * t2 + 8.0 / 47900160.0
    s = s * t2 + 6.0 / 1209600.0
    s = s * t2 + 4.0 / 30240.0
    return s * t2 + 2.0 / 720.0


@kernel
def log3_into(R, out):
    """Rotation vector [rad] of R, angle in [0, π]."""
    out[0], out[1], out[2], _, _, _ = _log_terms(R)


@kernel
def log6_into(T, out):
    """Twist ξ = (v, ω) with T = exp6(ξ): ω = log3(R) and v = α p − ½ ω×p + β (ωᵀp) ω."""
    wx, wy, wz, alpha, beta, _ = _log_terms(T)
    _log_of_terms(T, wx, wy, wz, alpha, beta, out)


@kernel
def _log_of_terms(T, wx, wy, wz, alpha, beta, out):
    px, py, pz = T[0, 3], T[1, 3], T[2, 3]
    along = beta * (wx * px + wy * py + wz * pz)
    out[0] = alpha * px - 0.5 * (wy * pz - wz * py) + along * wx
    out[1] = alpha * py - 0.5 * (wz * px - wx * pz) + along * wy
    out[2] = alpha * pz - 0.5 * (wx * py - wy * px) + along * wz
    out[3], out[4], out[5] = wx, wy, wz


@kernel
def _jlog3_of_terms(wx, wy, wz, alpha, beta, out):
    """α I + ½ [ω]× + β ω ωᵀ, into the upper left of `out`."""
    out[0, 0], out[1, 1], out[2, 2] = alpha + beta * wx * wx, alpha + beta * wy * wy, alpha + beta * wz * wz
    xy, xz, yz = beta * wx * wy, beta * wx * wz, beta * wy * wz
    hx, hy, hz = 0.5 * wx, 0.5 * wy, 0.5 * wz
    out[0, 1], out[1, 0] = xy - hz, xy + hz
    out[0, 2], out[2, 0] = xz + hy, xz - hy
    out[1, 2], out[2, 1] = yz - hx, yz + hx


@kernel
def jlog3_into(R, out):
    """Right Jacobian inverse (3, 3): log3(R exp3(δ)) ≈ log3(R) + jlog3(R) δ."""
    wx, wy, wz, alpha, beta, _ = _log_terms(R)
    _jlog3_of_terms(wx, wy, wz, alpha, beta, out)


@kernel
def _jlog6_of_terms(T, wx, wy, wz, alpha, beta, gamma, out):
    """[[A, C A], [0, A]] with A = jlog3(R) and C the derivative of α p − ½ ω×p + β (ωᵀp) ω along R."""
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
    """Right Jacobian inverse (6, 6): log6(T exp6(δ)) ≈ log6(T) + jlog6(T) δ."""
    wx, wy, wz, alpha, beta, gamma = _log_terms(T)
    _jlog6_of_terms(T, wx, wy, wz, alpha, beta, gamma, out)


@kernel
def log6_jlog6_into(T, log, jlog):
    """`log6_into` and `jlog6_into` at once, at half the price."""
    wx, wy, wz, alpha, beta, gamma = _log_terms(T)
    _log_of_terms(T, wx, wy, wz, alpha, beta, log)
    _jlog6_of_terms(T, wx, wy, wz, alpha, beta, gamma, jlog)


@kernel
def _exp_terms(theta):
    """(sin θ)/θ, (1 − cos θ)/θ² and (θ − sin θ)/θ³."""
    t2 = theta * theta
    if theta > _SERIES_BELOW:
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
    """Rotation about the vector omega by its length [rad] (Rodrigues), into the upper left of `out`."""
    x, y, z = omega[0], omega[1], omega[2]
    a, b, _ = _exp_terms(math.sqrt(x * x + y * y + z * z))
    xx, yy, zz = b * x * x, b * y * y, b * z * z
    out[0, 0], out[1, 1], out[2, 2] = 1.0 - yy - zz, 1.0 - xx - zz, 1.0 - xx - yy
    out[0, 1], out[1, 0] = b * x * y - a * z, b * x * y + a * z
    out[0, 2], out[2, 0] = b * x * z + a * y, b * x * z - a * y
    out[1, 2], out[2, 1] = b * y * z - a * x, b * y * z + a * x


@kernel
def exp6_into(twist, out):
    """Pose reached from the identity by the constant body twist (v, ω) in unit time."""
    exp3_into(twist[3:], out)
    vx, vy, vz, x, y, z = twist[0], twist[1], twist[2], twist[3], twist[4], twist[5]
    a, b, c = _exp_terms(math.sqrt(x * x + y * y + z * z))
    along = c * (x * vx + y * vy + z * vz)
    out[0, 3] = a * vx + b * (y * vz - z * vy) + along * x
    out[1, 3] = a * vy + b * (z * vx - x * vz) + along * y
    out[2, 3] = a * vz + b * (x * vy - y * vx) + along * z
    out[3, 0] = out[3, 1] = out[3, 2] = 0.0
    out[3, 3] = 1.0


@kernel
def relative_into(A, B, out):
    """A⁻¹ B, the pose of B seen from A; `out` must be neither of them."""
    for i in range(3):
        for j in range(3):
            out[i, j] = A[0, i] * B[0, j] + A[1, i] * B[1, j] + A[2, i] * B[2, j]
        dx, dy, dz = B[0, 3] - A[0, 3], B[1, 3] - A[1, 3], B[2, 3] - A[2, 3]
        out[i, 3] = A[0, i] * dx + A[1, i] * dy + A[2, i] * dz
    out[3, 0] = out[3, 1] = out[3, 2] = 0.0
    out[3, 3] = 1.0
