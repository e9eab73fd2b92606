"""`sns`, saturation in the null space: joints are held at their bounds, and levels are scaled if need be.

Level by level, the least-norm solution in the null space of the levels before is found. While a joint exceeds
its bound, the most critical one is held at that bound, and the others take over. If they cannot, the level is
scaled: A x = s b with the largest s ≤ 1 that was met on the way. A scaled level goes on in its own direction,
slower, and is not the least-squares optimum.

Source: after Flacco, De Luca and Khatib (2015), "Control of redundant robots under hard joint constraints:
saturation in the null space", IEEE Trans. Robotics 31(3), the basic algorithm for several tasks.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from taskopt.arrays import Array, Mask
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.rank import equality_levels
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import CLOSED_FORM_INSIDE, FIT_RANK
from taskopt.resolver.base import Memory, answered_by_x
from taskopt.resolver.closed_form import task_priority
from taskopt.resolver.closed_form_resolvers import refuse_inequalities
from taskopt.resolver.infeasible import no_answer


class Scaled(NamedTuple):
    """The solution of one level.

    Attributes:
        x: The unknowns after this level, (n,).
        scale: Task scale factor s in [0, 1].
        tries: Number of least-squares problems that were solved.
    """

    x: Array
    scale: float
    tries: int


@dataclass(frozen=True)
class NullSpaceSaturation:
    """Resolve by saturation in the null space, with task scaling.

    It keeps the box and the strict order of levels of equalities; it promises neither the optimum of a level
    that cannot be met in full, nor that a level that could be met is met. Its status is FORMULA: it claims
    nothing. The notes of its answer have the scale factor of each level that is scaled. It refuses
    inequalities in levels, hard rows and a norm other than the identity. The status is FAILED if x = 0 breaks
    the box and no level can mend that.

    Attributes:
        name: Name of the resolver.
        strict: False: a level that is scaled is not at its optimum.
    """

    name: str = "sns"
    strict: bool = False

    def __call__(self, hierarchy: Hierarchy, memory: Memory | None = None) -> tuple[Resolution, Memory]:  # noqa: ARG002
        """Resolve one hierarchy.

        Args:
            hierarchy: The problem of this tick.
            memory: Ignored.

        Returns:
            The answer, and an empty memory.

        Raises:
            InvalidValue: A level has an inequality, or there are hard rows, or the norm is another one.
        """
        refuse_inequalities(hierarchy, self.name)
        _refuse_rest(hierarchy, self.name)
        x, P, tries, notes = np.zeros(hierarchy.n), np.eye(hierarchy.n), 0, []
        for k, (A, b, weight) in enumerate(equality_levels(hierarchy)):
            if k == 0 or not len(b):
                continue
            root = np.sqrt(weight)[:, None]
            level = saturated(root * A, root[:, 0] * b, x, P, (hierarchy.box_lower, hierarchy.box_upper))
            x, tries = level.x, tries + level.tries
            P = P - _inverse(root * A @ P) @ (root * A @ P)
            if level.scale < 1.0:
                notes.append(f"Level {k} is scaled by {level.scale:.3g}.")
        if _outside(x, hierarchy.box_lower, hierarchy.box_upper).any():
            return no_answer(hierarchy, Status.FAILED, tries)
        found = answered_by_x(hierarchy, x, Status.FORMULA, tries).replaced(notes=tuple(notes))
        return found, Memory(np.zeros(hierarchy.layout.width, dtype=np.int8))

    def closed_form(self, hierarchy: Hierarchy) -> Array:
        """Return x (n,) of task priority, which this is while no bound is reached; see `task_priority`."""
        return task_priority(hierarchy)


def saturated(A: Array, b: Array, x: Array, P: Array, box: tuple[Array, Array]) -> Scaled:
    """Solve one level in the null space of those before, inside a box.

    Args:
        A: Rows, (m, n).
        b: Right-hand sides, (m,).
        x: Solution of the levels before, (n,).
        P: Projector on their null space, (n, n).
        box: Lower and upper bounds, (n,) each.

    Returns:
        The solution with the largest scale factor that was met; x itself, with scale 0, if there is none.
    """
    lower, upper = box
    held, value = np.zeros(len(x), dtype=bool), np.zeros(len(x))
    best, most = Scaled(x, 0.0, 0), np.linalg.matrix_rank(A @ P, FIT_RANK * max(1.0, float(np.abs(A).max())))
    for tries in range(1, len(x) + 2):
        along, fixed = _parts(A, b, x, P, held, value)
        if not _outside(along + fixed, lower, upper).any():
            return Scaled(np.clip(along + fixed, lower, upper), 1.0, tries)
        scale, joint = _largest_scale(along, fixed, lower, upper, held)
        if scale > best.scale:
            best = Scaled(np.clip(scale * along + fixed, lower, upper), scale, tries)
        held[joint] = True
        value[joint] = upper[joint] if (along + fixed)[joint] > upper[joint] else lower[joint]
        left = A @ _free_projector(P, held)
        if np.linalg.matrix_rank(left, FIT_RANK * max(1.0, float(np.abs(A).max()))) < most:
            break
    return best._replace(tries=tries)


def _parts(A: Array, b: Array, x: Array, P: Array, held: Mask, value: Array) -> tuple[Array, Array]:
    """Return the part of the solution that is in proportion to the scale of b, and the part that is not."""
    fixed = x
    if held.any():
        fixed = x + _inverse(P[held]) @ (value[held] - x[held])
    inverse = _inverse(A @ _free_projector(P, held))
    return inverse @ b, fixed - inverse @ (A @ fixed)


def _free_projector(P: Array, held: Mask) -> Array:
    """Return the projector on the directions that neither levels before nor held joints notice."""
    return P - _inverse(P[held]) @ P[held] if held.any() else P


def _largest_scale(along: Array, fixed: Array, lower: Array, upper: Array, held: Mask) -> tuple[float, int]:
    """Return the largest s ≤ 1 with s · along + fixed in the box, 0 for none, and the joint to hold next."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.sort(np.array([(lower - fixed) / along, (upper - fixed) / along]), axis=0)
    still = along == 0.0
    inside = (fixed >= lower) & (fixed <= upper)
    ends[0, still], ends[1, still] = np.where(inside[still], -np.inf, np.inf), np.inf
    ends[:, held] = np.array([[-np.inf], [np.inf]])
    joint = int(np.argmin(ends[1])) if np.isfinite(ends[1]).any() else int(np.argmax(ends[0]))
    most, least = float(ends[1].min()), float(ends[0].max())
    return (min(most, 1.0) if max(least, 0.0) <= most else 0.0), joint


def _outside(x: Array, lower: Array, upper: Array) -> Mask:
    """Return where x is outside the box by more than rounding."""
    room = CLOSED_FORM_INSIDE * np.maximum(1.0, np.abs(x))
    return (x < lower - room) | (x > upper + room)


def _inverse(A: Array) -> Array:
    """Return the pseudo-inverse, in which the rounding that projectors leave in rows is not inverted."""
    return np.asarray(np.linalg.pinv(A, rcond=FIT_RANK), dtype=np.float64)


def _refuse_rest(hierarchy: Hierarchy, name: str) -> None:
    """Raise `InvalidValue` for what the algorithm does not know."""
    limits = hierarchy.limits
    if len(limits.lower) and (np.isfinite(limits.lower) | np.isfinite(limits.upper)).any():
        raise InvalidValue(
            f"{name} knows bounds on single unknowns only, no hard row; use hqp/… or active-set"
        )
    if not np.array_equal(hierarchy.norm_matrix(), np.eye(hierarchy.n)):
        raise InvalidValue(f"{name} knows no norm but the identity; use hqp/… or active-set")
