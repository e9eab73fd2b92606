"""The check of a resolver, on random hierarchies and on hierarchies whose optimum is known."""

import numpy as np

from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy, Level
from taskopt.hierarchy.proof import Verdict, judge
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.resolver.base import Resolver, checked, missing_parts, require_answer
from taskopt.testing.sampling import require


def check_resolver(resolver: Resolver, *, accuracy: float = 1e-6, count: int = 20, seed: int = 0) -> None:
    """Check that a resolver fulfils the contract of `taskopt.resolver.base.Resolver`.

    - It has all parts of the protocol, and returns a `Resolution` and a `Memory`.
    - If no inequality is active, its answer is its own closed-form answer.
    - If it claims an optimum, its KKT residuals are small, the hard limits hold, and it is not refuted.
    - If it is strict, a lower level never makes a higher one worse.
    - It does not change the hierarchy, and its answer does not change when the hierarchy changes afterwards.
    - The memory that it returns fits the problem that is answered, is accepted again, and leads to the same
      answer.
    - If hard limits contradict each other, it claims no optimum.

    A resolver whose status is FORMULA does not consider limits, and is checked on hierarchies without
    inequalities.

    Args:
        resolver: The resolver.
        accuracy: Largest error of x, relative to max(1, |x|), and largest KKT residual that are accepted.
        count: Number of random hierarchies.
        seed: Seed of the first hierarchy; the others follow.

    Raises:
        AssertionError: Something does not hold; the message says what, for which seed, and by how much.
    """
    missing = missing_parts(resolver)
    require(not missing, f"the resolver lacks {', '.join(missing)}")
    formula = False
    for index in range(seed, seed + count):
        formula = _check_closed_form(resolver, index, accuracy)
        if formula:
            continue
        bound = random_hierarchy(index)
        answer = _resolve(resolver, bound, f"random hierarchy {index}")
        _check_claim(answer, accuracy, f"random hierarchy {index}")
        _check_memory(resolver, bound, accuracy, index)
        if resolver.strict:
            _check_strict(resolver, index, accuracy)
    if not formula:
        _check_contradiction(resolver)


def random_hierarchy(seed: int, levels: int = 3, reach: float = 0.5) -> Hierarchy:
    """Make a hierarchy of 6 unknowns with equalities, inequalities, weights, a box and hard rows.

    Args:
        seed: Seed of its numbers; the first levels are the same whatever `levels` is.
        levels: Number of levels.
        reach: Half of the width of the box. The bounds of a small box are nearly always active, those of a
            large one never.

    Returns:
        A hierarchy whose hard limits can hold together, since x = 0 is inside them.
    """
    rng = np.random.default_rng(seed)
    n, ranks = 6, []
    hard = Level(rng.normal(size=(2, n)), lower=[-reach, -np.inf], upper=[np.inf, reach], name="hard")
    for k in range(levels):
        A, b = rng.normal(size=(2, n)), rng.normal(size=2)
        weight = rng.uniform(0.5, 2.0, 2)
        inequality = k == 1
        ranks.append(
            Level(A, upper=b, weight=weight, name=f"level {k + 1}")
            if inequality
            else Level(A, b, weight=weight, name=f"level {k + 1}")
        )
    box = np.full(n, reach)
    return Hierarchy(ranks, box=(-box, box), limits=hard)


def _resolve(resolver: Resolver, hierarchy: Hierarchy, where: str) -> Resolution:
    """Resolve, and require that the hierarchy is unchanged and that the answer holds a copy of it."""
    before = hierarchy.buffer.copy()
    returned = resolver(hierarchy)
    try:
        resolution, _ = require_answer(returned, resolver.name, hierarchy)
    except InvalidValue as error:
        raise AssertionError(str(error)) from error
    require(np.array_equal(before, hierarchy.buffer), f"{resolver.name} changed {where}")
    apart = not np.shares_memory(resolution.problem.buffer, hierarchy.buffer)
    require(apart, f"the answer of {resolver.name} to {where} refers to the arrays of the hierarchy")
    return resolution


def _check_closed_form(resolver: Resolver, seed: int, accuracy: float) -> bool:
    """Require the closed-form answer where nothing is active; return True for a resolver without limits."""
    rng = np.random.default_rng(seed)
    ranks = [Level(rng.normal(size=(2, 6)), rng.normal(size=2)) for _ in range(2)]
    far = np.full(6, 1e3)
    hierarchy = Hierarchy(ranks, box=(-far, far))
    resolution = _resolve(resolver, hierarchy, f"hierarchy {seed} of equalities")
    expected = resolver.closed_form(hierarchy)
    require(expected.shape == (6,), f"the closed-form answer has shape {expected.shape}, not (6,)")
    formula = resolution.status is Status.FORMULA
    if formula and not resolver.strict:
        return True  # a damped formula is meant to differ
    claim = f"{resolver.name} claims {resolution.status.name} of hierarchy {seed} of equalities"
    require(formula or resolution.status is Status.SOLVED, claim)
    distance = float(np.abs(resolution.x - expected).max() / max(1.0, np.abs(expected).max()))
    sentence = f"where nothing is active {resolver.name} is {distance:.1e} from its closed form (seed {seed})"
    require(distance <= accuracy, sentence)
    return formula


def _check_claim(resolution: Resolution, accuracy: float, where: str) -> None:
    """Require that a claimed optimum meets its KKT conditions and hard limits, and is not refuted."""
    require(resolution.claimed, f"{resolution.status.name} of {where}, which has an optimum")
    certificate = resolution.certificate
    sentence = f"the claimed optimum of {where} is none: {certificate}, more than {accuracy:.1e}"
    require(certificate.kkt_met(accuracy), sentence)
    judgement = judge(resolution.problem, resolution.x, resolution.state, accuracy=accuracy)
    sentence = f"the claimed optimum of {where} is refuted: {judgement.reason}"
    require(judgement.verdict is not Verdict.REFUTED, sentence)


def _check_memory(resolver: Resolver, hierarchy: Hierarchy, accuracy: float, seed: int) -> None:
    """Require that the memory fits, that it is accepted, and that the same memory gives the same answer."""
    cold, memory = resolver(hierarchy)
    checked(memory, cold.problem.layout)
    warm, again = resolver(hierarchy, memory)[0], resolver(hierarchy, memory)[0]
    for other, what in ((again, "called twice with its own memory"), (cold, "called without a memory")):
        distance = float(np.abs(warm.x - other.x).max())
        sentence = f"{resolver.name} has an answer that is {distance:.1e} away if {what} (seed {seed})"
        require(distance <= accuracy * max(1.0, float(np.abs(cold.x).max())), sentence)


def _check_strict(resolver: Resolver, seed: int, accuracy: float) -> None:
    """Require that the cost of the levels stays the same when one more is added below."""
    fewer, more = (resolver(random_hierarchy(seed, levels))[0] for levels in (2, 3))
    for k, level in enumerate(random_hierarchy(seed, 2).levels):
        worse = level.cost(more.x) - level.cost(fewer.x)
        sentence = f"level {k + 1} of random hierarchy {seed} costs {worse:.1e} more with one level below it"
        require(worse <= accuracy, sentence)


def _check_contradiction(resolver: Resolver) -> None:
    """Require that no optimum is claimed of x₀ + x₁ ≥ 3 inside |x| ≤ 1."""
    box = (-np.ones(2), np.ones(2))
    limits = Level([[1.0, 1.0]], lower=[3.0])
    resolution, _ = resolver(Hierarchy([Level([[1.0, 0.0]], [0.5])], box=box, limits=limits))
    sentence = f"{resolver.name} claims an optimum where hard limits contradict each other"
    require(not resolution.claimed, sentence)
