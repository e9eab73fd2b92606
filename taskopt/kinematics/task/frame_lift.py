"""The kernel of the frame tasks at second order, which turns their rows A v = b into A q̈ = b.

With the terms of `frame_kernel`, ė = M (w_d − w), so that at second order

    A q̈ = M (ẇ_d − a) + Ṁ (w_d − w) + K_D ė + K_P e,    A = M w.

Here a = J̇ v is the acceleration that the frame has without q̈: its classical acceleration, that is the second
derivative of the position of its origin, and its angular acceleration, both along the axes of the world. With
the spatial Jacobian J of Pinocchio, (u, α) = J̇ v and the velocity ṗ of the origin p,

    a = (u + α × p + ω × ṗ, α).

No projector is differentiated: a are raw rows of the task. What turns with the frame or with the target
follows by the product rule:

    OWN       M = Jlog6(X) diag(Rᵀ, Rᵀ)       Ṁ d = J̇log6 Rᵀ d − Jlog6 (ω_own × Rᵀ d)
    WORLD     M = diag(I, Jlog3(E))           Ṁ d = (0, J̇log3 d_ω);  ω̇_d turned back by Eᵀ turns itself
    POSITION  M = [Rᵀ, −[e]× Rᵀ]              ë = Rᵀ (p̈_d − a_v) − ω_own × (Rᵀ (ṗ_d − ṗ) + ė) − Rᵀ a_ω × e
"""

from taskopt.jit import kernel, kernel_apart
from taskopt.kinematics.lie import turned_back
from taskopt.kinematics.log_rate import jlog6_rate
from taskopt.kinematics.task.base import task_acceleration
from taskopt.kinematics.task.frame_kernel import (
    ACCELERATION,
    ACTUAL,
    FULL_ERROR,
    GAIN,
    JLOG,
    M_ROWS,
    MEMORY_SHAPE,
    MOVING,
    OWN,
    RATE_GAIN,
    TARGET,
    TWIST,
    WORLD,
    X,
    acting_twist,
)


@kernel_apart
def frame_lift(parameters, memory, state, motion, rows):
    """Turn the rows of a frame task into rows of second order; `frame_rows` must have filled them.

    Args:
        parameters: As for `frame_rows`.
        memory: As for `frame_rows`.
        state: The robot, see `RobotState`.
        motion: Its motion, see `Motion`.
        rows: The m rows, see `RowArrays`.
    """
    table = memory.reshape(MEMORY_SHAPE)
    mode, m = parameters[0], parameters[2]
    T = table[ACTUAL : ACTUAL + 4, :4]
    p = T[0, 3], T[1, 3], T[2, 3]
    columns = parameters[3 + m :]
    v = _carried(state.jacobians, columns, motion.velocity)
    w = _at(v, p, (0.0, 0.0, 0.0))
    u = _carried(motion.jacobian_rates, columns, motion.velocity)
    bias = _at(u, p, _cross(v[3:], w[:3]))
    moving = table[MOVING, 0] != 0.0
    target = acting_twist(mode, T, table) if moving else (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    d = _minus(target, w)
    M = table[M_ROWS : M_ROWS + 6]
    rate = _product(M, d)
    change = _minus(
        _acting_acceleration(mode, table, w, d) if moving else (0.0, 0.0, 0.0, 0.0, 0.0, 0.0), bias
    )
    drift = _drift(mode, table, w, d, rate)
    forward = _product(M, change)
    for r in range(m):
        i = parameters[3 + r]
        rows.lower[r] = rows.upper[r] = task_acceleration(
            forward[i] + drift[i], table[GAIN, i], table[RATE_GAIN, i], table[FULL_ERROR, i], rate[i]
        )


@kernel
def _drift(mode, table, w, d, rate):
    """Compute Ṁ (w_d − w), six numbers; with POSITION, all terms of ë that hold no acceleration."""
    T = table[ACTUAL : ACTUAL + 4, :4]
    e = table[FULL_ERROR]
    if mode == OWN:
        turning = turned_back(T, w[3:])
        u = (*turned_back(T, d[:3]), *turned_back(T, d[3:]))
        minus = (*_cross(u[:3], turning), *_cross(u[3:], turning))
        xi = (-e[0], -e[1], -e[2], -e[3], -e[4], -e[5])
        back = (-rate[0], -rate[1], -rate[2], -rate[3], -rate[4], -rate[5])
        grown, turned = jlog6_rate(xi, back, u), _product(table[JLOG : JLOG + 6], minus)
        return (*_sum(grown[:3], turned[:3], (0.0, 0.0, 0.0)), *_sum(grown[3:], turned[3:], (0.0, 0.0, 0.0)))
    if mode == WORLD:
        xi = (0.0, 0.0, 0.0, e[3], e[4], e[5])
        return jlog6_rate(xi, (0.0, 0.0, 0.0, rate[3], rate[4], rate[5]), (0.0, 0.0, 0.0, d[3], d[4], d[5]))
    turning, moved = turned_back(T, w[3:]), turned_back(T, d[:3])
    total = (moved[0] + rate[0], moved[1] + rate[1], moved[2] + rate[2])
    return (*_cross(total, turning), 0.0, 0.0, 0.0)


@kernel
def _acting_acceleration(mode, table, w, d):
    """Compute the rate ẇ_d of the twist of the target, carried to where it acts; six numbers."""
    a = table[ACCELERATION]
    linear, angular = (a[0], a[1], a[2]), (a[3], a[4], a[5])
    if mode == OWN:
        T, target = table[ACTUAL : ACTUAL + 4, :4], table[TARGET : TARGET + 4, :4]
        omega = (table[TWIST, 3], table[TWIST, 4], table[TWIST, 5])
        to = (T[0, 3] - target[0, 3], T[1, 3] - target[1, 3], T[2, 3] - target[2, 3])
        apart = (w[0] - table[TWIST, 0], w[1] - table[TWIST, 1], w[2] - table[TWIST, 2])
        one, two = _cross(angular, to), _cross(omega, apart)
        return (*_sum(linear, one, two), *angular)
    if mode == WORLD:
        E = table[X : X + 4, :4]
        back = turned_back(E, (table[TWIST, 3], table[TWIST, 4], table[TWIST, 5]))
        return (*linear, *_sum(turned_back(E, angular), _cross(back, d[3:]), (0.0, 0.0, 0.0)))
    return (*linear, 0.0, 0.0, 0.0)


@kernel
def _carried(J, columns, v):
    """Compute J v over some columns, six numbers."""
    a = b = c = d = e = f = 0.0
    for j in columns:
        x = v[j]
        a, b, c = a + J[0, j] * x, b + J[1, j] * x, c + J[2, j] * x
        d, e, f = d + J[3, j] * x, e + J[4, j] * x, f + J[5, j] * x
    return a, b, c, d, e, f


@kernel
def _at(twist, p, more):
    """Compute (v + ω × p + more, ω) of a twist (v, ω) at the origin of the world."""
    x, y, z = _sum(twist[:3], _cross(twist[3:], p), more)
    return x, y, z, twist[3], twist[4], twist[5]


@kernel
def _cross(x, y):
    """Compute x × y."""
    return x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]


@kernel
def _sum(x, y, z):
    """Compute x + y + z of three vectors."""
    return x[0] + y[0] + z[0], x[1] + y[1] + z[1], x[2] + y[2] + z[2]


@kernel
def _minus(x, y):
    """Compute x − y of two twists."""
    return x[0] - y[0], x[1] - y[1], x[2] - y[2], x[3] - y[3], x[4] - y[4], x[5] - y[5]


@kernel
def _product(M, x):
    """Compute M x of a matrix (6, 6) and a twist, six numbers."""
    return _row(M[0], x), _row(M[1], x), _row(M[2], x), _row(M[3], x), _row(M[4], x), _row(M[5], x)


@kernel
def _row(a, x):
    """Compute the product of a row of six with a twist."""
    return a[0] * x[0] + a[1] * x[1] + a[2] * x[2] + a[3] * x[3] + a[4] * x[4] + a[5] * x[5]
