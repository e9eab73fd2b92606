"""The test of `taskopt.hierarchy.rank_doubt` for eight arms in lock-step: may a level be near a loss of rank?

It has the same bounds of ε² and of what makes a level below swing, and the same rows B, and asks if
B Bᵀ − ε² I can be factored. Nothing is kept
from step to step, since a factorisation of eight arms costs less than finding out which arms need a new one.
"""

from taskopt.arrays import Array
from taskopt.hierarchy.rank_doubt import LITTLE
from taskopt.hierarchy.tolerances import NEAR_LOSS, REST_LEAST, ZERO_ROW
from taskopt.jit import kernel
from taskopt.jit.pack import load, root, size, spread, store, where_less
from taskopt.resolver.active_set.lockstep.factor import factorise
from taskopt.resolver.active_set.lockstep.records import ArmRows, ArmScratch, Watch


@kernel
def ranks_in_doubt(
    watch: Watch, rows: ArmRows, x: Array, scratch: ArmScratch, shape: tuple[int, int]
) -> Array:
    """Return 1 for arms of which a level may need damping to come to rest, else 0.

    Args:
        watch: What all arms share.
        rows: The hierarchies.
        x: The answers, (n, 8).
        scratch: Memory, overwritten.
        shape: m and n.

    Returns:
        The pack.
    """
    m, n = shape
    squares = spread(0.0)
    for j in range(n):
        squares = squares + load(x, j) * load(x, j)
    limit, lever, slip = _largest_threshold(watch, rows, x, squares, scratch.trial, shape)
    swing = _swing_limit(watch, rows, x, slip, scratch.trial, shape)
    limit = where_less(limit, swing, swing, limit)
    _leave_out_near(watch, rows, root(squares), scratch.trial, n)
    for a in range(m):
        length = spread(0.0)
        for j in range(n):
            length = length + load(rows.A, a * n + j) * load(rows.A, a * n + j)
        length = root(length)
        scale = spread(1.0 if watch.counted[a] else 0.0)
        if watch.counted[a] and watch.group[a] == 0:
            scale = lever / where_less(length, ZERO_ROW, ZERO_ROW, length)
        for j in range(n):
            store(scratch.S, a * n + j, scale * load(scratch.trial, j) * load(rows.A, a * n + j))
        empty = where_less(length, ZERO_ROW, where_less(size(load(rows.r, a)), ZERO_ROW, 1.0, 0.0), 0.0)
        if not watch.counted[a]:
            empty = spread(1.0)
        store(scratch.extra, a, where_less(0.5, empty, 1.0, -limit))
    sound = factorise(scratch.extra, scratch.S, scratch.L, scratch.diagonal, shape)
    return where_less(limit, REST_LEAST, 0.0, 1.0 - sound)


@kernel
def _largest_threshold(
    watch: Watch, rows: ArmRows, x: Array, squares: Array, levers: Array, shape: tuple[int, int]
) -> tuple[Array, Array, Array]:
    """Return a bound of ε², the largest lever, and the sum of R² max w of all groups."""
    asked, lever, _, whole = _sum_groups(watch, rows, x, spread(0.0), levers, shape)
    _, _, left, slip = _sum_groups(watch, rows, x, asked, levers, shape)
    period = watch.period[0]
    slip = period * root(slip * squares)
    both = slip + root(slip * slip + (4.0 * period) * left)
    short, long = period * asked, 0.25 * (both * both)
    return where_less(short, long, short, long), lever, whole


@kernel
def _swing_limit(
    watch: Watch, rows: ArmRows, x: Array, slip: Array, levers: Array, shape: tuple[int, int]
) -> Array:
    """Return σ_min² up to which a level below curved rows may swing; see `rank_doubt`."""
    m, n = shape
    heaviest = spread(0.0)
    for j in range(n):
        store(levers, j, spread(0.0))
    for a in range(m):
        if not watch.counted[a]:
            value, squares = spread(0.0), spread(0.0)
            for j in range(n):
                entry = load(rows.A, a * n + j)
                value, squares = value + entry * load(x, j), squares + entry * entry
            left = watch.weight[a] * (value - load(rows.r, a))
            for j in range(n):
                store(levers, j, load(levers, j) + load(rows.A, a * n + j) * left)
            squares = watch.weight[a] * squares
            heaviest = where_less(heaviest, squares, squares, heaviest)
    steepest, weight = _steepness(levers, heaviest, n), 0.0
    for j in range(watch.below.size):
        store(levers, j, watch.below[j] * (load(x, j) - load(rows.x0, j)))
        weight = max(weight, watch.below[j])
    last = _steepness(levers, spread(weight), watch.below.size)
    swing = watch.period[0] * watch.period[0] * slip * where_less(steepest, last, last, steepest)
    weak = (NEAR_LOSS * NEAR_LOSS) * slip  # at least the square of the largest lever
    return where_less(swing, weak, swing, weak)


@kernel
def _steepness(pull: Array, heaviest: Array, n: int) -> Array:
    """Return ‖p‖² over the square of the heaviest weight, 0 where there is none."""
    total = spread(0.0)
    for j in range(n):
        total = total + load(pull, j) * load(pull, j)
    least = where_less(heaviest, ZERO_ROW, 1.0, heaviest)
    return where_less(heaviest, ZERO_ROW, 0.0, total / (least * least))


@kernel
def _sum_groups(
    watch: Watch, rows: ArmRows, x: Array, asked: Array, levers: Array, shape: tuple[int, int]
) -> tuple[Array, Array, Array, Array]:
    """Return Σ R ‖w b‖, the largest R, the sum of what is left, and that of R² max w.

    Groups that ask for next to nothing of `asked` leave what they ask for, and do not count in the last sum.
    """
    m, n = shape
    total, lever, left, slip = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
    first = 0
    while first < m:
        stop = first + 1
        while stop < m and watch.group[stop] == watch.group[first]:
            stop += 1
        if watch.group[first] > 0:
            own, missed, square = _sum_group(watch, rows, x, levers, (first, stop, n))
            total, left = total + own, left + missed
            left = left + where_less(LITTLE * asked, own, 0.0, own)
            slip = slip + where_less(own, LITTLE * asked, 0.0, watch.heaviest[first] * square)
            lever = where_less(lever, root(square), root(square), lever)
        first = stop
    return total, lever, left, slip


@kernel
def _sum_group(
    watch: Watch, rows: ArmRows, x: Array, levers: Array, place: tuple[int, int, int]
) -> tuple[Array, Array, Array]:
    """Return R ‖w b‖, R ‖w r‖ and R² of a group of curved rows."""
    first, stop, n = place
    asked, missed, square = spread(0.0), spread(0.0), spread(0.0)
    for j in range(n):
        store(levers, j, spread(0.0))
    for a in range(first, stop):
        value, w = spread(0.0), watch.weight[a]
        for j in range(n):
            entry = load(rows.A, a * n + j)
            value = value + entry * load(x, j)
            store(levers, j, load(levers, j) + entry * entry)
        b = load(rows.r, a)
        asked = asked + (w * b) * (w * b)
        missed = missed + (w * (value - b)) * (w * (value - b))
    for j in range(n):
        square = where_less(square, load(levers, j), load(levers, j), square)
    lever = root(square)
    return lever * root(asked), lever * root(missed), square


@kernel
def _leave_out_near(watch: Watch, rows: ArmRows, speed: Array, keep: Array, n: int) -> None:
    """Write 0 for each column that a limit on positions may hold, else 1; see `rank_doubt.near_limits`."""
    for j in range(n):
        lower, upper = load(rows.lower, j), load(rows.upper, j)
        below = where_less(watch.base[0, j], lower, where_less(speed, -lower, 1.0, 0.0), 1.0)
        above = where_less(upper, watch.base[1, j], where_less(speed, upper, 1.0, 0.0), 1.0)
        store(keep, j, below * above)
