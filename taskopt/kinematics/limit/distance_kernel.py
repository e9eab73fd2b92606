"""Kernels of the distance limits."""

import numpy as np

from taskopt.jit import kernel

_LEAST = 1e-9  # [m] what a step may lose at the margin itself, so that v = 0 is not the only way out


@kernel
def approach_into(distance, gradient, turn, known, margin, influence, gain, dt, A, lower, share):
    """Rows and shares; `known` has travel, jump, bend and reserve of each pair."""
    for k in range(share.size):
        share[k] = np.inf
    for i in range(distance.size):
        travel, jump, bend, reserve = known[0, i], known[1, i], known[2, i], known[3, i]
        room = distance[i] - margin
        near = not distance[i] >= influence  # so that NaN is handed on, and found
        for k in range(A.shape[1]):
            A[i, k] = gradient[i, k] if near else 0.0
        if near:
            free = max(room - reserve, 0.0)
            lower[i] = -gain * free / dt
            budget, first = room - gain * free, jump
            if room < _LEAST:
                budget = max(_LEAST, -0.1 * room)
        else:
            lower[i] = -np.inf
            budget, first = room, travel
        s = 2.0 * budget / (first + np.sqrt(first * first + 4.0 * bend * budget))
        for k in range(share.size):
            if turn[i, k] != 0.0:
                share[k] = min(share[k], s)


@kernel
def narrow_to_speeds(share, speeds, bounds, index):
    """Narrow the bounds to |v_k| ≤ s_k v̄_k."""
    for k in range(share.size):
        limit = share[k] * speeds[k]
        if not -limit <= bounds[0, k]:
            bounds[0, k], bounds[2, k] = -limit, index
        if not limit >= bounds[1, k]:
            bounds[1, k], bounds[3, k] = limit, index
