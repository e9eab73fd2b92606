"""No answer: a solver failed, or hard limits contradict each other. Which of the two is for us to decide."""

import numpy as np

from taskopt.hierarchy.certificate import RESIDUALS, TOLERANCE
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.resolver.base import Memory, answered
from taskopt.resolver.infeasible import agree


def unanswered(hierarchy: Hierarchy, status: Status, iterations: int = 0) -> tuple[Resolution, Memory]:
    """x = NaN: nothing here may be sent to a robot. `status`: what the solver gave for its reason.

    INFEASIBLE if and only if our own phase one finds a contradiction. Solvers claim it of programs that
    are only hard for them, and give up, or run on, where there is one.
    """
    if not agree(hierarchy):
        status = Status.INFEASIBLE
    elif status is Status.INFEASIBLE:
        status = Status.FAILED
    width = hierarchy.layout.width
    multipliers = np.zeros((hierarchy.layout.level_count + 1, width))
    nothing = np.zeros(width, dtype=np.int8)
    return answered(hierarchy, np.full(hierarchy.n, np.nan), multipliers, nothing, status, iterations)


def unless_broken(answer: tuple[Resolution, Memory]) -> tuple[Resolution, Memory]:
    """The answer, unless it claims an optimum, breaks a hard limit, and phase one says that it must."""
    resolution = answer[0]
    broken = float(resolution.certificate.residuals[:, RESIDUALS.index("primal")].max())
    if not resolution.claimed or broken <= TOLERANCE or agree(resolution.problem):
        return answer
    return unanswered(resolution.source, Status.INFEASIBLE, resolution.iterations)
