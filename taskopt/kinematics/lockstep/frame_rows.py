"""Error of a frame and its derivative in lock-step: the kernel of `task.frame_kernel` for eight arms.

The modes OWN, WORLD and POSITION and the matrix M of each are those of `task.frame_kernel`. Logarithms and
their derivatives are those of `taskopt.kinematics.lie`, without branches: both the series and the closed form
of each scalar are computed, and the right one is taken for each arm.
"""

from taskopt.hierarchy.tolerances import NO_ANGLE, SERIES_BELOW
from taskopt.jit import kernel
from taskopt.jit.pack import load, root, spread, store, where_less
from taskopt.kinematics.lockstep.functions import angle_of
from taskopt.kinematics.task.frame_kernel import OWN, POSITION

MATRIX = 36  # packs of M, row by row


@kernel
def error_and_matrix(mode, turns, pose, goal, error, M):
    """Write the error of a frame and the matrix M with A = M w.

    Args:
        mode: Kind of error, `OWN`, `WORLD` or `POSITION`.
        turns: True if a row of the task is a rotation; else only the first three rows are right.
        pose: Pose of the frame, (12, 8).
        goal: Its target, (12, 8).
        error: (6, 8) receives the error.
        M: (36, 8) receives M, row by row.
    """
    if mode == OWN:
        _own(pose, goal, error, M)
    elif mode == POSITION:
        _position(pose, goal, error, M)
    else:
        _world(turns, pose, goal, error, M)


@kernel
def _own(pose, goal, error, M):
    """Write error and matrix of the mode OWN: −log6(X) and Jlog6(X) diag(Rᵀ, Rᵀ), X = T_d⁻¹ T."""
    E = _product(goal, pose)
    moved = (
        load(pose, 9) - load(goal, 9),
        load(pose, 10) - load(goal, 10),
        load(pose, 11) - load(goal, 11),
    )
    px, py, pz = _turned_back(goal, moved)
    w, alpha, beta, gamma = _log_terms(E)
    wx, wy, wz = w
    dot = wx * px + wy * py + wz * pz
    along = beta * dot
    store(error, 0, -(alpha * px - 0.5 * (wy * pz - wz * py) + along * wx))
    store(error, 1, -(alpha * py - 0.5 * (wz * px - wx * pz) + along * wy))
    store(error, 2, -(alpha * pz - 0.5 * (wx * py - wy * px) + along * wz))
    store(error, 3, -wx)
    store(error, 4, -wy)
    store(error, 5, -wz)
    A = _jlog3(w, alpha, beta)
    p = (px, py, pz)
    toward_p = gamma * (wx * wx + wy * wy + wz * wz) + 2.0 * beta
    half = (0.5 * px, 0.5 * py, 0.5 * pz)
    zero = 0.0 * px
    skew = ((zero, -half[2], half[1]), (half[2], zero, -half[0]), (-half[1], half[0], zero))
    for i in range(3):
        u = gamma * dot * w[i] - toward_p * p[i]
        c0 = u * wx + beta * w[i] * px + skew[i][0]
        c1 = u * wy + beta * w[i] * py + skew[i][1]
        c2 = u * wz + beta * w[i] * pz + skew[i][2]
        ca0 = c0 * A[0][0] + c1 * A[1][0] + c2 * A[2][0] + along * A[i][0]
        ca1 = c0 * A[0][1] + c1 * A[1][1] + c2 * A[2][1] + along * A[i][1]
        ca2 = c0 * A[0][2] + c1 * A[1][2] + c2 * A[2][2] + along * A[i][2]
        for k in range(3):
            x, y, z = load(pose, k), load(pose, 3 + k), load(pose, 6 + k)
            turned = A[i][0] * x + A[i][1] * y + A[i][2] * z
            store(M, 6 * i + k, turned)
            store(M, 6 * i + 21 + k, turned)
            store(M, 6 * i + 3 + k, ca0 * x + ca1 * y + ca2 * z)
            store(M, 6 * i + 18 + k, spread(0.0))


@kernel
def _world(turns, pose, goal, error, M):
    """Write error and matrix of the mode WORLD: [p_d − p; log3(E)] and diag(I, Jlog3(E)), E = R_d Rᵀ."""
    for k in range(MATRIX):
        store(M, k, spread(0.0))
    for i in range(3):
        store(error, i, load(goal, 9 + i) - load(pose, 9 + i))
        store(M, 7 * i, spread(1.0))
    if turns:
        w, alpha, beta, _ = _log_terms(_product_of_transposed(goal, pose))
        A = _jlog3(w, alpha, beta)
        for i in range(3):
            store(error, 3 + i, w[i])
            for j in range(3):
                store(M, 6 * i + 21 + j, A[i][j])


@kernel
def _position(pose, goal, error, M):
    """Write error and matrix of the mode POSITION: Rᵀ (p_d − p) and [Rᵀ, −Rᵀ [p_d − p]×]."""
    dx = load(goal, 9) - load(pose, 9)
    dy = load(goal, 10) - load(pose, 10)
    dz = load(goal, 11) - load(pose, 11)
    for i in range(3):
        x, y, z = load(pose, 3 * i), load(pose, 3 * i + 1), load(pose, 3 * i + 2)
        store(error, i, x * dx + y * dy + z * dz)
        store(M, 6 * i, x)
        store(M, 6 * i + 1, y)
        store(M, 6 * i + 2, z)
        store(M, 6 * i + 3, z * dy - y * dz)
        store(M, 6 * i + 4, x * dz - z * dx)
        store(M, 6 * i + 5, y * dx - x * dy)


@kernel
def _turned_back(pose, v):
    """Return Rᵀ v of a pose, as three packs."""
    return (
        load(pose, 0) * v[0] + load(pose, 1) * v[1] + load(pose, 2) * v[2],
        load(pose, 3) * v[0] + load(pose, 4) * v[1] + load(pose, 5) * v[2],
        load(pose, 6) * v[0] + load(pose, 7) * v[1] + load(pose, 8) * v[2],
    )


@kernel
def _product(a, b):
    """Return R_aᵀ R_b, row by row."""
    x = _turned_back(a, (load(b, 0), load(b, 1), load(b, 2)))
    y = _turned_back(a, (load(b, 3), load(b, 4), load(b, 5)))
    z = _turned_back(a, (load(b, 6), load(b, 7), load(b, 8)))
    return (x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])


@kernel
def _outer_row(a, b, i):
    """Return row i of R_a R_bᵀ."""
    x, y, z = load(a, i), load(a, 3 + i), load(a, 6 + i)
    return (
        x * load(b, 0) + y * load(b, 3) + z * load(b, 6),
        x * load(b, 1) + y * load(b, 4) + z * load(b, 7),
        x * load(b, 2) + y * load(b, 5) + z * load(b, 8),
    )


@kernel
def _product_of_transposed(a, b):
    """Return R_a R_bᵀ, row by row."""
    return _outer_row(a, b, 0), _outer_row(a, b, 1), _outer_row(a, b, 2)


@kernel
def _quaternion(R):
    """Return the unit quaternion (w, x, y, z) of a rotation with w ≥ 0, from its largest component.

    Source:
        Shepperd (1978), as in `lie`.
    """
    a, b, c = R[0][0], R[1][1], R[2][2]
    trace = a + b + c
    dx, dy, dz = R[2][1] - R[1][2], R[0][2] - R[2][0], R[1][0] - R[0][1]
    sxy, sxz, syz = R[1][0] + R[0][1], R[0][2] + R[2][0], R[2][1] + R[1][2]
    best, w, x, y, z = a, dx, 1.0 + a - b - c, sxy, sxz
    w, x = where_less(best, b, dy, w), where_less(best, b, sxy, x)
    y, z = where_less(best, b, 1.0 + b - c - a, y), where_less(best, b, syz, z)
    best = where_less(best, b, b, best)
    w, x = where_less(best, c, dz, w), where_less(best, c, sxz, x)
    y, z = where_less(best, c, syz, y), where_less(best, c, 1.0 + c - a - b, z)
    best = where_less(best, c, c, best)
    w, x = where_less(best, trace, 1.0 + trace, w), where_less(best, trace, dx, x)
    y, z = where_less(best, trace, dy, y), where_less(best, trace, dz, z)
    inverse = 1.0 / root(w * w + x * x + y * y + z * z)
    inverse = where_less(w, 0.0, -inverse, inverse)
    return w * inverse, x * inverse, y * inverse, z * inverse


@kernel
def _log_terms(R):
    """Return the rotation vector ω, α, β and γ of a rotation, which `lie` defines."""
    w, x, y, z = _quaternion(R)
    s2 = x * x + y * y + z * z
    s = root(s2)
    theta = 2.0 * angle_of(s, w)
    t2 = theta * theta
    divisor = where_less(s, NO_ANGLE, 1.0, s)
    scale = where_less(s, NO_ANGLE, 2.0, theta / divisor)
    beta, gamma = spread(1.0 / 74724249600.0), spread(12.0 / 74724249600.0)
    for k in range(6):
        beta = beta * t2 + _BETA[k]
    for k in range(5):
        gamma = gamma * t2 + _GAMMA[k]
    far = where_less(theta, SERIES_BELOW, 1.0, t2)
    alpha = where_less(theta, SERIES_BELOW, 1.0 - t2 * beta, 0.5 * theta * w / divisor)
    beta = where_less(theta, SERIES_BELOW, beta, (1.0 - alpha) / far)
    closed = (alpha + 0.25 * t2 / (divisor * divisor) - 2.0) / (far * far)
    gamma = where_less(theta, SERIES_BELOW, gamma, closed)
    return (scale * x, scale * y, scale * z), alpha, beta, gamma


_BETA = (
    691.0 / 1307674368000.0, 1.0 / 47900160.0, 1.0 / 1209600.0, 1.0 / 30240.0, 1.0 / 720.0, 1.0 / 12.0,
)  # fmt: skip
_GAMMA = (6910.0 / 1307674368000.0, 8.0 / 47900160.0, 6.0 / 1209600.0, 4.0 / 30240.0, 2.0 / 720.0)


@kernel
def _jlog3(w, alpha, beta):
    """Return α I + ½ [ω]× + β ω ωᵀ, row by row."""
    x, y, z = w
    xy, xz, yz = beta * x * y, beta * x * z, beta * y * z
    return (
        (alpha + beta * x * x, xy - 0.5 * z, xz + 0.5 * y),
        (xy + 0.5 * z, alpha + beta * y * y, yz - 0.5 * x),
        (xz - 0.5 * y, yz + 0.5 * x, alpha + beta * z * z),
    )
