"""The faults that `mutants.py` plants, by name: the file, a piece of its text, and what stands there then."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Fault:
    """One fault.

    Attributes:
        name: What is wrong with the mutant, in a few words.
        file: Path of the file, from the folder `taskopt`.
        old: A piece of its text that stands there once.
        new: What stands there in the mutant.
        constant: Name of the constant that the fault changes, or "" for other faults.
        harmless: Why no answer can change, for a fault that must survive; "" for all others.
    """

    name: str
    file: str
    old: str
    new: str
    constant: str = ""
    harmless: str = ""


_TABLE = "hierarchy/tolerances.py"
_CERTIFICATE = "hierarchy/certificate.py"
_SEARCH = "resolver/active_set/search.py"
_START = "resolver/active_set/start.py"
_LEXLS = "resolver/active_set/lexls.py"
_CYCLES = "resolver/active_set/cycles.py"
_TICK = "resolver/active_set/tick.py"
_FAST = "resolver/active_set/fast_path.py"
_FRAME = "kinematics/task/frame_kernel.py"


def _constant(name: str, constant: str, old: str, new: str, file: str = _TABLE, harmless: str = "") -> Fault:
    """Return the fault that a constant has another value."""
    old, new = (f"\n{constant} = {value}" for value in (old, new))
    return Fault(name, file, old, new, constant, harmless)


_OF_SEARCH = (
    Fault("no row is ever dropped", _SEARCH, "if leaving < 0:", "if leaving < n + count:"),
    Fault(
        "a row is dropped at the last wrong level",
        _SEARCH,
        "if leaving >= 0:\n            continue",
        "if leaving >= n + rows.lower.size:\n            continue",
        harmless="drops in another order change the number of steps only: no sign is wrong in the end",
    ),
    Fault(
        "any row of wrong sign is dropped, not the worst",
        _SEARCH,
        "(leaving < 0 or signed < worst)",
        "True",
        harmless="drops in another order change the number of steps only: no sign is wrong in the end",
    ),
    Fault("the sign at an early level decides nothing", _SEARCH, "decided[j] = True", "decided[j] = False"),
    Fault(
        "an equality may be dropped",
        _SEARCH,
        "decided[n + i] |= rows.lower[i] == rows.upper[i]",
        "decided[n + i] |= False",
    ),
    Fault("no bound stops a step", _SEARCH, "if step < alpha or entering < 0:", "if step < 0.0:"),
    Fault("the farthest bound stops a step", _SEARCH, "if step < alpha or", "if step > alpha or"),
    Fault(
        "a row that comes straight back is not locked",
        _SEARCH,
        "locks.locked[entering] = locks.dropped[entering]",
        "locks.locked[entering] = False",
    ),
    Fault(
        "locked rows stay locked",
        _SEARCH,
        "locks.locked[j] = False",
        "pass",
        harmless="the certificate refuses what they spoil, and a search without guess follows",
    ),
    Fault(
        "no second search",
        _SEARCH,
        "outcome != Outcome.SOLVED and rounds < limit",
        "outcome != outcome and rounds < limit",
    ),
    Fault("no perturbation", _START, "return SEARCH_PERTURBATION * (", "return 0.0 * ("),
    Fault(
        "the perturbation stays in the answer",
        _SEARCH,
        "        _resolve_true_bounds(rows, state, here, multipliers)\n",
        "        pass\n",
    ),
    Fault(
        "violated rows do not join at the start",
        _START,
        "if state[n + i] == Held.FREE:\n            state[n + i] = row_side(",
        "if state[n + i] != state[n + i]:\n            state[n + i] = row_side(",
    ),
    Fault(
        "violated bounds of the box do not join at the start",
        _START,
        "state[j] = box_side(",
        "box_side(",
    ),
    Fault(
        "x is not put onto the bounds that hold it",
        _SEARCH,
        "x[j] = problem.box_upper[j] if state[j] == Held.UPPER else problem.box_lower[j]",
        "pass",
    ),
    Fault(
        "x is not clipped to the box",
        _SEARCH,
        "x[j] = min(max(x[j], problem.box_lower[j]), problem.box_upper[j])",
        "pass",
    ),
    Fault(
        "a dropped row beyond its other bound is set free",
        _SEARCH,
        "if beyond == -side:",
        "if beyond != beyond:",
    ),
    Fault(
        "the search takes w for its root",
        _SEARCH,
        "root = 1.0 if i < problem.offsets[1] else np.sqrt(problem.weight[i])",
        "root = 1.0 if i < problem.offsets[1] else problem.weight[i]",
    ),
    Fault(
        "a contradiction of hard rows counts as solved",
        _SEARCH,
        "return Outcome.CONTRADICTION\n    return",
        "return Outcome.SOLVED\n    return",
    ),
    _constant("multipliers count from 1e4 times larger on", "SEARCH_SIGN", "1e-14", "1e-10"),
    _constant("rows may be violated 1e4 times more", "SEARCH_FEASIBLE", "1e-12", "1e-8"),
    Fault(
        "no start without the guess",
        _TICK,
        "if outcome in (Outcome.ITERATION_LIMIT, Outcome.CYCLED) or (",
        "if outcome != outcome or (outcome != outcome and ",
    ),
    Fault(
        "no tick says that it keeps moved bounds",
        _TICK,
        "residuals[0, PRIMAL] > STILL_PERTURBED",
        "residuals[0, PRIMAL] > 1.0",
    ),
    Fault(
        "moved bounds stay moved",
        "resolver/active_set/resolver.py",
        "went_on = outcome == Outcome.STILL_PERTURBED and",
        "went_on = outcome == Outcome.NOT_FINITE and",
    ),
    Fault("a cycle is not seen", _CYCLES, "same &= seen[j] == mark", "same &= seen[j] == mark + 16"),
    Fault("every second drop looks like a cycle", _CYCLES, "same &= seen[j] == mark", "same &= drops > 1"),
    Fault(
        "no further search after a cycle",
        "resolver/active_set/resolver.py",
        "elif outcome == Outcome.CYCLED and search",
        "elif outcome == Outcome.NOT_FINITE and search",
    ),
    Fault(
        "an answer that misses its KKT conditions is claimed",
        _TICK,
        "elif outcome == Outcome.SOLVED and worst > KKT_MET:",
        "elif outcome != outcome:",
    ),
    Fault("a compromise between contradicting limits is returned", _TICK, "x[j] = np.nan  #", "pass  #"),
    _constant("digits that rows lose are not won back", "DIGITS_LOST", "2e-7", "0.0"),
    Fault(
        "a direction that rounding makes is brought back",
        "resolver/active_set/resolver.py",
        "if not found.candidates or found.doubtful:",
        "if not found.candidates:",
    ),
    Fault("ticks are never seen to alternate", _TICK, "= like_previous > like_last", "= False"),
)

_OF_LEXLS = (
    Fault(
        "the pivot is the first row, not the largest",
        _LEXLS,
        "and remainder > best:",
        "and pivot < 0:",
        harmless="every row is tested for rank all the same; only rounding differs",
    ),
    Fault("no row is dependent", _LEXLS, "remainder > LOST * scale[order[a]]", "remainder > 0.0"),
    Fault(
        "rank is lost 1e5 times sooner",
        _LEXLS,
        "remainder > LOST * scale[order[a]]",
        "remainder > 1e5 * LOST * scale[order[a]]",
    ),
    Fault("targets have the wrong sign", _LEXLS, "value = -target[order[a]]", "value = target[order[a]]"),
    Fault(
        "dependent rows keep the residual from before their level",
        _LEXLS,
        "residual[a] += L[a, c] * z[c]",
        "residual[a] += 0.0",
    ),
    Fault(
        "multipliers of rows have the wrong sign",
        _LEXLS,
        "value, sum_of = -gradient[r0 + p], magnitude[r0 + p]",
        "value, sum_of = gradient[r0 + p], magnitude[r0 + p]",
    ),
    Fault(
        "rounding does not grow on its way to a multiplier",
        _LEXLS,
        "for q in range(p, end):",
        "for q in range(p, p + 1):",
    ),
    Fault(
        "the coarse search keeps rounding of dependent rows",
        _LEXLS,
        "if rounding > 0.0:",
        "if rounding < 0.0:",
    ),
    Fault(
        "multipliers count as zero by the size that decides ranks",
        _SEARCH,
        "solve_levels(factor, rows.size,",
        "solve_levels(factor, rows.scale,",
    ),
    Fault(
        "multipliers leave out the levels in between",
        _LEXLS,
        "gradient[c] += multiplier * L[first + p, c]",
        "gradient[c] += 0.0",
    ),
    Fault(
        "the norm pulls held unknowns the wrong way",
        _LEXLS,
        "(-x[j], abs(x[j])) if k == levels",
        "(x[j], abs(x[j])) if k == levels",
    ),
    Fault(
        "least squares substitute with the wrong sign",
        _LEXLS,
        "value -= B[p, b] * z[r0 + b]",
        "value += B[p, b] * z[r0 + b]",
    ),
    Fault(
        "reflections cancel digits",
        _LEXLS,
        "alpha = -norm if head > 0.0 else norm",
        "alpha = norm if head > 0.0 else -norm",
    ),
)

_OF_FAST_PATH = (
    _constant("sign gate of the fast path 1e3 times wider", "FAST_PATH_SIGN", "1e-10", "1e-7"),
    _constant("feasibility gate of the fast path 1e3 times wider", "FAST_PATH_FEASIBLE", "1e-12", "1e-9"),
    _constant("the fast path accepts tiny pivots", "FAST_PATH_PIVOT", "1e-7", "1e-14"),
    _constant("the fast path does not refine", "PASSES", "2", "1", _FAST),
    Fault(
        "the fast path has no multipliers of the norm",
        _FAST,
        "    if joint_rows:\n        _norm",
        "    if n < 0:\n        _norm",
    ),
    Fault(
        "the fast path does not look at rows left out",
        _FAST,
        "if verdict == Verdict.ACCEPTED and not _keeps_rows(problem.A, problem.lower, problem.upper, x):",
        "if levels < 0:",
    ),
    Fault(
        "the fast path forgets weights of joint rows",
        _FAST,
        "last.x0[j] += weight[i] * lower[i]",
        "last.x0[j] += lower[i]",
    ),
    Fault(
        "the fast path takes w for 1/w",
        _FAST,
        "K[a, a] += 1.0 / weight[saddle.rows[a]]",
        "K[a, a] += weight[saddle.rows[a]]",
    ),
    Fault(
        "the fast path forgets the cost of uncovered unknowns",
        _FAST,
        "G[b, b] += D[saddle.uncovered[b]]",
        "pass",
    ),
)

_OF_CERTIFICATE = (
    Fault(
        "answers are claimed with residuals 1e3 times larger",
        "hierarchy/certificate.py",
        "return self.worst <= tolerance",
        "return self.worst <= 1e3 * tolerance",
    ),
    _constant("any noise frees a sign", "CERTIFICATE_ROUNDING", "1e-13", "0.0"),
    _constant("only large multipliers free a sign", "CERTIFICATE_ROUNDING", "1e-13", "1e-4"),
    _constant("a multiplier within the fit error frees a sign", "CERTAIN_MULTIPLIER", "10.0", "0.0"),
    Fault(
        "the certificate takes the other sign for right",
        _CERTIFICATE,
        "max(-y, 0.0) if to_upper <= to_lower else max(y, 0.0)",
        "max(y, 0.0) if to_upper <= to_lower else max(-y, 0.0)",
    ),
    Fault(
        "complementarity is a product",
        _CERTIFICATE,
        "min(abs(y), min(to_lower, to_upper) /",
        "abs(y) * (min(to_lower, to_upper) /",
    ),
    Fault(
        "violations of hard rows count 1e3 times less",
        _CERTIFICATE,
        "primal = max(primal, gap / max(judged.size[i]",
        "primal = max(primal, 1e-3 * gap / max(judged.size[i]",
    ),
    Fault(
        "violations of the box do not count",
        _CERTIFICATE,
        "primal = max(primal, gap / max(1.0, abs(x[j])))",
        "primal = max(primal, 0.0)",
    ),
    Fault(
        "the certificate forgets weights",
        _CERTIFICATE,
        "judged.force[i] = rows.weight[i] * (gap if",
        "judged.force[i] = (gap if",
    ),
    Fault(
        "NaN in a row is not noticed", _CERTIFICATE, "return np.inf if missing else primal", "return primal"
    ),
    Fault(
        "any multiplier frees the sign of a row",
        _CERTIFICATE,
        "judged.sign_free[n + i] = wrong == 0.0 and abs(force) > certain",
        "judged.sign_free[n + i] = True",
    ),
    Fault(
        "any multiplier frees the sign of a bound",
        _CERTIFICATE,
        "judged.sign_free[j] = wrong == 0.0 and abs(y[j]) > certain",
        "judged.sign_free[j] = True",
    ),
    Fault(
        "violated rows keep their sign",
        _CERTIFICATE,
        "violated = gap > CERTIFICATE",
        "violated = gap < -CERTIFICATE",
    ),
    _constant("fits ignore violations up to 1e-6", "FIT_VIOLATED", "1e-9", "1e-6"),
    Fault(
        "fits take far rows for active",
        "hierarchy/multipliers.py",
        "> near * scale] = 0",
        "> 1e5 * near * scale] = 0",
    ),
    _constant("gradients up to 1e-6 get no multipliers", "NO_GRADIENT", "1e-13", "1e-6"),
    Fault(
        "fits give violated rows one sign",
        "hierarchy/multipliers.py",
        "return (lower >= upper) | violated, side",
        "return lower >= upper, side",
    ),
    Fault("fits forget the side", "hierarchy/multipliers.py", "y_signed = side * _non", "y_signed = _non"),
)

_OF_PROOF = (
    Fault(
        "the other side of an undecided bound is taken for decided",
        "hierarchy/proof/prover.py",
        "undecided |= more | {(i, int(state[i])) for i, _ in more if state[i]}",
        "undecided |= more",
    ),
    Fault(
        "a set with a wrong pair is proven",
        "hierarchy/proof/prover.py",
        "                    if outcome.wrong:\n",
        "                    if outcome.x is None:\n",
    ),
    Fault(
        "multipliers of the wrong sign are right",
        "hierarchy/proof/working_set.py",
        "elif side * entry[0] < 0.0:",
        "elif side == 0:",
    ),
    Fault(
        "signs that rounding hides are decided",
        "hierarchy/proof/working_set.py",
        "if not sure:",
        "if side == 0:",
    ),
    Fault(
        "violations that rounding hides are none",
        "hierarchy/proof/working_set.py",
        "rows[~outside[:, 0] & ~inside[:, 0]]",
        "rows[outside[:, 0] & inside[:, 0]]",
    ),
    Fault(
        "violated rows are satisfied",
        "hierarchy/proof/working_set.py",
        "for i in rows[outside[:, 0]].tolist()",
        "for i in rows[outside[:, 0] & inside[:, 0]].tolist()",
    ),
    Fault(
        "solutions of linear equations have no radius",
        "hierarchy/proof/linear.py",
        "return V.widened(ROUNDED_UP * (error + np.outer(sums, largest)))",
        "return V.widened(0.0 * (error + np.outer(sums, largest)))",
    ),
    Fault(
        "any approximate inverse will do",
        "hierarchy/proof/linear.py",
        "if not worst < LARGEST_DEFECT:",
        "if not worst < np.inf:",
    ),
    Fault(
        "dependent rows agree whatever their bounds",
        "hierarchy/proof/exact_span.py",
        "row[-1] == 0, others",
        "row[-1] == row[-1], others",
    ),
    Fault(
        "bounds up to 1e3 times larger prove an answer",
        "hierarchy/proof/judging.py",
        "if (bound <= asked).all():",
        "if (bound <= 1e3 * asked).all():",
    ),
    Fault(
        "what is not proven is refuted",
        "hierarchy/proof/judging.py",
        "if (least > most).any():",
        "if (bound > asked).any():",
    ),
    Fault(
        "a direction without a rank refutes an answer",
        "hierarchy/proof/lost.py",
        "return tuple(decide) if level.cost(x) <= level.cost(optimum) else ()",
        "return ()",
    ),
    _constant("sums and products of pairs have no error", "UNIT_OF_PAIRS", "2.0**-103", "0.0"),
)

_OF_HIERARCHY = (
    Fault(
        "the rank scale ignores weights and norms",
        "hierarchy/rank.py",
        "float(max(root.max(initial=0.0), ",
        "float(max(0.0, ",
    ),
    Fault(
        "rank has no hysteresis", "hierarchy/rank.py", "return min(max(before, sure), kept)", "return kept"
    ),
    Fault(
        "rows that nothing moves are a singularity",
        "hierarchy/rank.py",
        "return np.linalg.norm(J, axis=1) > ZERO_ROW",
        "return np.linalg.norm(J, axis=1) >= 0.0 * ZERO_ROW",
    ),
    Fault("a norm may be singular", "hierarchy/problem.py", "if smallest <= 0.0 or", "if smallest < 0.0 or"),
    Fault(
        "a norm may be unsymmetric",
        "hierarchy/problem.py",
        "not (diagonal or np.allclose(",
        "not (matrix.size or np.allclose(",
    ),
    Fault("an interval may be empty at infinity", "hierarchy/problem.py", " | (lower == np.inf)", ""),
    Fault(
        "the KKT distance is not scaled",
        "hierarchy/qp.py",
        "np.abs(value - nearest)) / size",
        "np.abs(value - nearest))",
    ),
    Fault(
        "every level is near a loss of rank",
        "hierarchy/causes.py",
        "(sigma < small)).any():\n            return True\n    return False",
        "(sigma < small)).any():\n            return True\n    return True",
    ),
    Fault(
        "one symptom names the cause", "hierarchy/alternation.py", "if 2 * shown >= examined", "if shown > 0"
    ),
    Fault(
        "Chiaverini damps in proportion",
        "hierarchy/damping.py",
        "(least / self.epsilon) ** 2",
        "(least / self.epsilon)",
    ),
    Fault(
        "filtering damps in proportion",
        "hierarchy/damping.py",
        "(sigma / self.epsilon) ** 2",
        "(sigma / self.epsilon)",
    ),
    Fault("Sugihara damps twice as much", "hierarchy/damping.py", "0.5 * float(b @ b)", "float(b @ b)"),
    _constant("explain calls misses of 1e-4 met", "EXPLAINED_MET", "1e-8", "1e-4"),
    Fault(
        "explain names the other side",
        "hierarchy/explain.py",
        "bool(value[i] > upper[i])",
        "bool(value[i] < upper[i])",
        harmless="the sentence differs only where two limits own the bounds of one unknown",
    ),
    Fault(
        "a bound binds at the last level with a multiplier",
        "hierarchy/active.py",
        "int(np.argmax(_counted(values)))",
        "len(values) - 1 - int(np.argmax(_counted(values)[::-1]))",
    ),
)

_OF_RESOLVERS = (
    Fault(
        "one level has the ratio of one level", "resolver/closed_form.py", "max(levels, 2)", "max(levels, 1)"
    ),
    Fault(
        "the range of J is 1e6 times wider",
        "resolver/closed_form.py",
        "<= tolerance * np.linalg.norm(v)",
        "<= 1e6 * tolerance * np.linalg.norm(v)",
    ),
    Fault(
        "damping enters as k, not k²",
        "resolver/descent.py",
        "return damping.k**2 if",
        "return damping.k if",
    ),
    Fault(
        "the weighted problem shifts ratios by a level",
        "resolver/weighted_kernels.py",
        "ratio ** float(max(k, 1) - 1 - levels)",
        "ratio ** float(max(k, 1) - levels)",
    ),
    Fault(
        "the weighted problem forgets the norm",
        "resolver/weighted_kernels.py",
        "made.weight[count + i] = norm[i] if diagonal else 1.0",
        "made.weight[count + i] = 1.0",
    ),
    _constant(
        "levels of hqp may be violated 1e3 times more",
        "LEVEL_VIOLATION",
        "1e-9",
        "1e-6",
    ),
    _constant(
        "rows of hqp freeze from 1e3 times larger multipliers on",
        "LEVEL_MULTIPLIER",
        "1e-6",
        "1e-3",
        harmless="While a level keeps its residuals, a row with a multiplier stays at its bound;"
        " lower levels see it as an inequality that can only hold with equality.",
    ),
    Fault(
        "rows that hold a level of hqp back are not frozen",
        "resolver/hqp.py",
        "before.selected(active).G",
        "before.selected(active & False).G",
    ),
    Fault(
        "answers in which long rows hide a short one are claimed",
        "resolver/hqp.py",
        "if self.converged and not self.hidden else",
        "if self.converged else",
    ),
    _constant("least squares see every row", "INVISIBLE_ROW", "1e-8", "0.0"),
    Fault(
        "known-feasible rows are not clipped",
        "resolver/level_qp.py",
        "        if feasible:\n",
        "        if feasible is None:\n",
    ),
    _constant(
        "proximal steps are not retried", "_PULLS", "(1e-4, 1e-2, 1.0)", "(1e-4,)", "resolver/level_qp.py"
    ),
    Fault(
        "violated rows are not active",
        "resolver/base.py",
        "(has_multiplier | violated) &",
        "has_multiplier &",
    ),
    Fault(
        "conflicts are not minimal",
        "resolver/infeasible.py",
        "            members = rest\n",
        "            pass\n",
    ),
    Fault(
        "relaxation gives half the gap",
        "resolver/infeasible.py",
        "+= gap + room if upper",
        "+= 0.5 * gap + room if upper",
    ),
    Fault(
        "a refuted claim stays infeasible",
        "resolver/infeasible.py",
        "        status = Status.FAILED\n",
        "        pass\n",
    ),
    Fault(
        "the fallback is taken whatever its KKT residuals",
        "resolver/fallback.py",
        "if found.claimed and found.kkt_met() and",
        "if found.claimed and",
    ),
    Fault(
        "a refuted answer of the fallback is taken",
        "resolver/fallback.py",
        " and not _refuted(found):",
        ":",
    ),
    Fault(
        "phase one is not asked",
        "resolver/fallback.py",
        "if not limits_agree(hierarchy):",
        "if hierarchy is not None:",
    ),
    Fault(
        "multipliers of lower bounds have the wrong sign",
        "solver/one_sided.py",
        "y[self.below] -= of_inequal",
        "y[self.below] += of_inequal",
    ),
    Fault(
        "claims that break hard limits are sent",
        "loop/loop.py",
        "return resolution.broken_limit <= CLAIM_KEEPS_LIMITS",
        "return True",
    ),
    Fault(
        "velocities that are not finite are sent",
        "loop/loop.py",
        "if not is_finite(resolution.x):\n        return False",
        "if resolution.x is None:\n        return False",
    ),
    Fault(
        "a conflict leaves its memory behind",
        "loop/loop.py",
        "        self.forget()\n        plan, when",
        "        plan, when",
    ),
)

_OF_KINEMATICS = (
    Fault("the twist of a target acts at the target", _FRAME, "return vx + dy * wz - dz * wy,", "return vx,"),
    Fault("the gain of another row", _FRAME, "memory[GAIN, i], error[i])", "memory[GAIN, r], error[i])"),
    Fault(
        "the target turns in the wrong axes",
        _FRAME,
        "E[0, 0] * wx + E[1, 0] * wy + E[2, 0] * wz",
        "E[0, 0] * wx + E[0, 1] * wy + E[0, 2] * wz",
    ),
    Fault(
        "own axes do not turn with the frame",
        _FRAME,
        "M[i, 3] = T[2, i] * dy - T[1, i] * dz",
        "M[i, 3] = 0.0",
    ),
    Fault("the lever arm of a frame lacks a term", _FRAME, "M[i, 3] + py * c - pz * b", "M[i, 3] + py * c"),
    Fault("the orientation error has the wrong sign", _FRAME, "error[i] = -error[i]", "error[i] = error[i]"),
    Fault(
        "feedforward of another joint",
        "kinematics/task/joint.py",
        "memory[rates + column] if",
        "memory[rates + i] if",
    ),
    Fault(
        "continuous joints go the long way round",
        "kinematics/task/joint.py",
        "np.arctan2(sd * c - cd * s, cd * c + sd * s)",
        "np.arctan2(sd, cd) - np.arctan2(s, c)",
    ),
    Fault(
        "the centre of mass turns the wrong way",
        "kinematics/task/centre_of_mass.py",
        "J[4, k] * z - J[5, k] * y",
        "J[4, k] * z + J[5, k] * y",
    ),
    Fault(
        "level damping takes k² for k",
        "kinematics/task/level_damping.py",
        "np.sqrt(self._damping(sigma[: np.count_nonzero(moved)], (root * b)[moved])[:r])",
        "self._damping(sigma[: np.count_nonzero(moved)], (root * b)[moved])[:r]",
    ),
    Fault(
        "a joint outside its range must return",
        "kinematics/limit/joint.py",
        "min(rate * (memory[3 * i + 1] + margin - q), 0.0)",
        "rate * (memory[3 * i + 1] + margin - q)",
    ),
    Fault(
        "braking as in continuous time",
        "kinematics/limit/acceleration.py",
        "stopping = room / (n + 1.0) + 0.5 * step * n",
        "stopping = np.sqrt(2.0 * step * room)",
    ),
    Fault(
        "a joint may have to brake harder than it can",
        "kinematics/limit/acceleration.py",
        "if bound < brake:",
        "if bound != bound:",
    ),
    Fault(
        "bounds that cross by rounding contradict each other",
        "kinematics/limit/base.py",
        "bounds[0, j] = bounds[1, j] = upper + ",
        "bounds[0, j] = upper + ",
    ),
    Fault(
        "bounds that contradict each other meet in the middle",
        "kinematics/limit/base.py",
        "if lower > upper and lower - upper <= CROSSED",
        "if lower > upper or lower - upper <= -CROSSED",
    ),
    Fault(
        "a posture below a level near a loss of rank is not damped",
        "hierarchy/rest_rows.py",
        "swing / heaviest - 1.0",
        "0.0 * swing / heaviest - 1.0",
    ),
    Fault(
        "the quick look forgets levels below",
        "hierarchy/rank_doubt.py",
        "return min(squares * (dt * steepest) ** 2",
        "return min(0.0 * squares * (dt * steepest) ** 2",
    ),
    _constant("a link at its margin may move 1 cm", "CONTACT", "1e-9", "1e-2"),
    Fault(
        "distance limits keep no reserve",
        "kinematics/limit/bound_distance.py",
        "np.minimum(self.jump + 2.0 * self.bend, ",
        "np.minimum(0.0 * self.jump, ",
    ),
    Fault(
        "far pairs do not bound the speed",
        "kinematics/limit/bound_distance.py",
        "largest_share(pair[Pair.TRAVEL], pair[Pair.BEND], room)",
        "largest_share(pair[Pair.TRAVEL], pair[Pair.BEND], 1e9 * room)",
    ),
    Fault(
        "the band of a transition closes in proportion to time",
        "kinematics/task/transition.py",
        "/ _SHARE * np.expm1(_KAPPA * np.asarray(openness))",
        "* np.asarray(openness)",
    ),
    Fault(
        "a task comes before it begins",
        "kinematics/task/transition.py",
        "self.begin - t + self.blend if",
        "self.begin - t if",
    ),
)

FAULTS: tuple[Fault, ...] = (
    *_OF_SEARCH,
    *_OF_LEXLS,
    *_OF_FAST_PATH,
    *_OF_CERTIFICATE,
    *_OF_PROOF,
    *_OF_HIERARCHY,
    *_OF_RESOLVERS,
    *_OF_KINEMATICS,
)
