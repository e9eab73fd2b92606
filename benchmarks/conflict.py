"""Hard limits of 7-joint problems, up to five of them active or contradictory: found, minimal, and how fast.

Each problem has a box, of which up to five bounds are within 1e-9 of a point, and rows that are met there,
missed by little, missed by much, equalities, or duplicates. A linear program (HiGHS), which asks for the
least largest violation, is the judge; problems that miss by 1e-10 to 1e-8 are either, and count for none.
"""

import argparse
from time import perf_counter

import numpy as np
from scipy.optimize import linprog

from taskopt import Hierarchy, Level
from taskopt.arrays import Array
from taskopt.resolver.infeasible import Conflict, Side, find_conflict

JOINTS, UNSURE = 7, (1e-10, 1e-8)
_EXACT = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}


def problem(rng: np.random.Generator) -> Hierarchy:
    """A random problem; about two of five cannot hold."""
    x = rng.uniform(-0.8, 0.8, JOINTS)
    upper_box = rng.uniform(1.0, 2.0, JOINTS)
    lower_box = -upper_box
    for j in rng.choice(JOINTS, rng.integers(0, 6), replace=False):
        near = rng.choice([0.0, 1e-12, 1e-10, 1e-9])
        (upper_box if rng.random() < 0.5 else lower_box)[j] = x[j] + near
    lower_box, upper_box = np.minimum(lower_box, x), np.maximum(upper_box, x)
    m = int(rng.integers(1, 6))
    A = rng.normal(size=(m, JOINTS)) * rng.choice([0.1, 1.0, 10.0])
    A[-1] = A[-1] if rng.random() < 0.7 else rng.choice([-1.0, 0.0, 2.0]) * A[0]
    lower, upper = A @ x - 10.0 ** rng.uniform(-3, 0, m), A @ x + 10.0 ** rng.uniform(-3, 0, m)
    kind = rng.integers(4)
    if kind == 1:
        lower = upper = A @ x
    if kind == 2:  # the last row lies beyond the farthest corner of the box, or just within
        corner = A[-1] @ np.where(A[-1] > 0.0, upper_box, lower_box)
        lower[-1] = corner + rng.choice([-1e-7, 1e-12, 1e-7, 1e-6, 1e-3])
        upper[-1] = lower[-1] + 1.0
    if kind == 3:
        lower = A @ x + 2.0 * rng.normal(size=m)
        upper = lower + rng.uniform(0.0, 1.0, m)
    limits = Level(A, lower=lower, upper=upper)
    return Hierarchy(
        [Level(np.eye(JOINTS), rng.normal(size=JOINTS))], box=(lower_box, upper_box), limits=limits
    )


def least_violation(hierarchy: Hierarchy, kept: set[Side] | None = None) -> float:
    """The least largest violation of the hard limits, or of those kept, by a linear program."""
    lower = np.concatenate([hierarchy.box_lower, hierarchy.limits.lower])
    upper = np.concatenate([hierarchy.box_upper, hierarchy.limits.upper])
    names = [hierarchy.name_of(j, True) for j in range(hierarchy.n)] + list(hierarchy.layout.row_names)
    chosen = None if kept is None else {(side.name, side.side) for side in kept}
    rows: list[Array] = []
    bounds: list[float] = []
    for i, row in enumerate(np.vstack([np.eye(hierarchy.n), hierarchy.limits.A])):
        for side, sign, bound in (("lower", -1.0, lower[i]), ("upper", 1.0, upper[i])):
            if np.isfinite(bound) and (chosen is None or (names[i], side) in chosen):
                rows.append(np.append(sign * row, -1.0))
                bounds.append(sign * float(bound))
    if not rows:
        return 0.0
    cost = np.append(np.zeros(hierarchy.n), 1.0)
    free = [(None, None)] * hierarchy.n + [(0.0, None)]
    return float(linprog(cost, A_ub=rows, b_ub=bounds, bounds=free, options=_EXACT).fun)


def minimal(hierarchy: Hierarchy, found: Conflict) -> bool:
    """Return True if the members cannot hold together, but can without any one of them."""
    members = set(found.members)
    without = (least_violation(hierarchy, members - {side}) for side in members)
    return least_violation(hierarchy, members) > 0.0 and all(miss <= UNSURE[1] for miss in without)


def main() -> None:
    options = argparse.ArgumentParser(description="Conflicts of hard limits.")
    options.add_argument("--problems", type=int, default=2000)
    count = options.parse_args().problems
    rng, wrong, not_minimal, unsure = np.random.default_rng(0), 0, 0, 0
    times: dict[bool, list[float]] = {False: [], True: []}
    find_conflict(problem(rng))
    for _ in range(count):
        hierarchy = problem(rng)
        begin = perf_counter()
        found = find_conflict(hierarchy)
        times[found is not None].append(1e3 * (perf_counter() - begin))
        miss = least_violation(hierarchy)
        between = UNSURE[0] < miss < UNSURE[1]
        unsure += between
        wrong += not between and (found is not None) != (miss > UNSURE[1])
        not_minimal += found is not None and not minimal(hierarchy, found)
    failed = f"{wrong} wrong, {not_minimal} not minimal"
    print(f"{count} problems, {len(times[True])} in conflict, {unsure} unsure, {failed}")
    for contradicts, taken in times.items():
        what = "conflict and minimal set" if contradicts else "no conflict"
        print(f"{what}: median {np.median(taken):.2f} ms, p99 {np.percentile(taken, 99):.2f} ms")


if __name__ == "__main__":
    main()
