"""The status that a resolver or a solver gives its own answer."""

from enum import Enum


class Status(Enum):
    """The claim of a resolver or solver about its own answer; the value of each member is advice in words.

    A status is only a claim. The error bound of the certificate decides if an answer is proven.
    """

    SOLVED = "it claims an optimum; the certificate decides"
    FORMULA = "a closed form that knows no limits; it claims nothing"
    ITERATION_LIMIT = "it stopped before it was done; scale the rows, or ask for less accuracy"
    INFEASIBLE = "it claims that the hard limits contradict each other; find_conflict says which, if they do"
    RELAXED = "the optimum after hard limits that contradict each other gave way; its notes say by how much"
    BRAKED = "the hard limits contradict each other, and it brakes to standstill; its notes say which"
    FAILED = "it gave up, or its answer is not a number; look at the rows it was given"


NO_OPTIMUM = frozenset({Status.FORMULA, Status.BRAKED})  # answers that do not aim at an optimum
