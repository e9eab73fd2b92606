"""All tolerances of the package, each with its purpose and the effect of a smaller or larger value.

Tolerances are plain numbers, since compiled kernels read them as constants. Counts, such as the number of
times that a search may be repeated, are defined where they are used, with their reason. "Relative to the row"
means relative to the Euclidean norm of the row, or to its largest term |A_ij x_j| where the entry says so.
"""

# --- KKT residuals: hierarchy/certificate, hierarchy/multipliers, hierarchy/qp -------------------------

KKT_MET = 1e-8
"""Largest KKT residual, relative as in `Certificate`, with which `active-set` claims an answer.

Smaller: right answers of interior-point and augmented-Lagrangian solvers are refused, since they stop near
1e-9. Larger: answers that are off by that share of their level's gradient are claimed.
"""

CERTIFICATE_ROUNDING = 1e-13
"""A multiplier, or a violation, below this share of its level's scale is rounding, and frees no sign.

The certificate lets a row carry either sign at later levels once it was needed, or violated, at an earlier
one. Smaller: rounding noise of about 1e-15 frees rows that nothing decided, and wrong answers are claimed.
Larger: right answers with small multipliers, as near singularities, are refused.
"""

CERTAIN_MULTIPLIER = 10.0
"""A multiplier must exceed this many times the stationarity left at its level to free the sign of its row.

Smaller: a multiplier that is itself a fit error frees a row. Larger: answers of loose solvers are refused
where later levels pull against their limits.
"""

AT_BOUND = 1e-8
"""Distance to a bound, relative to max(1, largest term of the row), below which x stands on that bound.

It decides which rows may take a multiplier when only x is known. Smaller: answers of solvers that stop at
1e-9 lose the multipliers that prove them. Larger: rows take multipliers that complementarity then refuses.
"""

FIT_VIOLATED = 1e-9
"""Violation of a row, relative to its largest term, beyond which a fitted multiplier may have either sign.

It is larger than `CERTIFICATE_ROUNDING`, because x may come from a solver that stops at 1e-9. Smaller: solver
noise frees signs, and the certificate refuses the fit. Larger: violated rows keep one sign; no fit exists.
"""

NO_GRADIENT = 1e-13
"""Largest entry of a level's gradient that needs no multipliers at all: the level is stationary as it is.

Smaller: multipliers are fitted to rounding noise. Larger: levels in small units lose their multipliers.
"""

FIT_RANK = 1e-10
"""Singular value, relative to the largest, below which rows count as dependent when multipliers are fitted.

Smaller: dependent rows get huge multipliers that cancel. Larger: rows near a singularity get none.
"""

FIT_DONE = 1e-14
"""Largest entry that the sign-free rows leave of a gradient, relative to it, below which the fit is done.

Smaller: a least-squares problem of pure rounding is solved as well. Larger: signed rows lack a multiplier.
"""

# --- Proof by an error bound: hierarchy/proof -----------------------------------------------------------

UNIT_OF_PAIRS = 2.0**-103
"""Relative error ε of one sum or product of double-double numbers, 8u² with u = 2⁻⁵³, derived in the docs.

Smaller: enclosures would not be proven to contain the exact numbers. Larger: bounds on x grow with it.
"""

ROUNDED_UP = 1.0 + 2.0**-40
"""Factor by which a radius is enlarged, since it is computed in rounded numbers itself.

It covers sums of up to 4000 terms. Smaller: radii of long sums could be too small. Larger: bounds are wider.
"""

UNDERFLOW = 1e-300
"""Error of a product of two doubles whose parts underflow; 1e-321 is proven.

Smaller: nothing changes before 1e-321. Larger: tiny numbers are no longer known to be different from zero.
"""

SMALLEST_PRODUCT = 1e-250
"""Least magnitude of a product of two doubles whose parts cannot underflow, so that it is exact as a pair.

Smaller: at 1e-292 parts begin to underflow. Larger: exact products get a radius, and exact ties stay hidden.
"""

SMALLEST_SCALED = 1e-100
"""Least magnitude of a scaled number other than zero with which a problem is judged.

Smaller: products of four such numbers underflow, and the exact error of a product is lost.
"""

LARGEST_SCALED = 1e100
"""Largest magnitude of a scaled number with which a problem is judged.

Larger: products of three such numbers overflow, and nothing is proven either.
"""

DEPENDENCE_TESTED = 1e-6
"""Part of a row outside the span of others, relative to the row, below which integers decide if it depends.

Smaller: a dependent row may pass as independent because of rounding, so that nothing is proven. Larger: more
rows are tested, which takes time.
"""

LARGEST_DEFECT = 0.1
"""Largest norm of I − X M with which an approximate inverse X of M counts as one.

Smaller: matrices near singular ones are given up although their inverses could be enclosed. At 1 the
enclosure is infinite.
"""

HINT_AT_BOUND = 1e-7
"""Distance to a bound, relative to the row and its terms, below which an x suggests that it is active.

It only chooses the active set that is tried first. Smaller: active bounds are missed for loose answers.
Larger: inactive ones are tried.
"""

# --- Names and sentences: hierarchy/active, hierarchy/explain, hierarchy/alternation -------------------

COUNTED_MULTIPLIER = 1e-9
"""A multiplier below this share of max(1, the largest of its level or row) counts as none.

It decides at which level an active row is said to bind, and which rows a solver's answer holds active.
Smaller: rows are named that only noise holds. Larger: limits near a singularity are not named.
"""

COUNTED_VIOLATION = 1e-9
"""A violation below this share of max(1, |value|) is solver accuracy, and counts as none.

Smaller: rows that solvers meet to 1e-10 are named as violated. Larger: missed inequalities are not named.
"""

EXPLAINED_MET = 1e-8
"""A row that misses its target by less, relative to max(1, |target|), is called met in `explain`.

Smaller: sentences speak of misses of solver accuracy. Larger: misses of a user's interest are hidden.
"""

DECISIVE_MULTIPLIER = 1e-8
"""A multiplier below this share of max(1, the largest) decides nothing when alternation is blamed on a cause.

Smaller: alternation by rounding is blamed on gain or rank. Larger: real contacts are blamed on rounding.
"""

NEAR_RANK_LOSS = 1e-3
"""σ_min/σ_max of the rows of a level below which alternation is blamed on a loss of rank.

Smaller: singular postures are blamed on the gain. Larger: ordinary postures are blamed on rank.
"""

LOST_FOR_GOOD = 1e-12
"""σ/σ_max below which a direction is lost for good, so that no alternation comes from it.

Smaller: rounding counts as a direction. Larger: directions that are nearly lost are not blamed.
"""

SIGN_CHANGE = 1e-9
"""Right-hand side, relative to max(1, |it|), whose change of sign counts as an overshot target.

Smaller: noise around zero counts as overshooting. Larger: overshooting in small motions is missed.
"""

SMALLEST_JUMP = 1e-3
"""Change of a velocity in one tick [rad/s, m/s] from which it is compared with the change of the problem.

Smaller: the steepest jump of a run is one that nobody feels. Larger: an arm that trembles goes unseen.
"""

LEAST_CHANGE = 1e-12
"""Change of the problem [rad/s, m/s] that is taken where it is less, when a jump is compared with it.

Smaller: a problem that changes by rounding only makes ratios without meaning. Larger: jumps from nothing look
smaller than they are.
"""

FOLLOWS_DATA = 10.0
"""Change of the answer, per unit of change of the problem, up to which it merely follows its problem.

Smaller: targets that move fast are blamed on rank. Larger: a level that loses rank is blamed on its target.
"""

# --- Rank: hierarchy/rank -------------------------------------------------------------------------------

LOST = 1e-10
"""A direction is lost where its singular value, or what is left of its row, is at most this share of it.

Smaller: joint velocities may exceed 1/LOST times what the task asks for. Larger: directions near a
singularity are given up although double precision could still follow them.
"""

REGAINED = 1e-9
"""A direction that was lost is back where its singular value exceeds this share of the rows (hysteresis).

It must not be below `LOST`; equal to it, the rank may alternate from tick to tick.
"""

# --- Accuracy of x: resolvers and their second look -----------------------------------------------------

ACCURACY = 1e-8
"""Error of x relative to its largest entry that a resolver is asked for, unless it is told another one.

Smaller: first-order solvers run into their iteration limits. Larger: velocities are visibly wrong.
"""

SMALLEST_VELOCITY = 1e-6
"""[rad/s, m/s] An x with a smaller largest entry counts as this large: nothing is exact relative to zero.

Smaller: answers near rest are called inaccurate for noise. Larger: slow motions are judged too kindly.
"""

SYMMETRY = 1e-12
"""Relative difference between an entry of a matrix and its transpose, up to which it counts as symmetric.

Smaller: matrices that are symmetric but for rounding are refused. Larger: wrong input passes.
"""

SYMMETRY_FLOOR = 1e-14
"""Absolute difference between an entry of H and its transpose that counts as none: entries may be zero."""

# --- Control loop and run -----------------------------------------------------------------------------

CLAIM_KEEPS_LIMITS = 1e-6
"""Largest primal residual (relative, see `Certificate`) of a claimed optimum that may be sent to a robot.

Smaller: a loop stops at answers of solvers that work to 1e-7, though nothing is wrong with them. Larger: a
velocity that visibly leaves a hard limit is sent because somebody claims that it is the optimum.
"""

STOPPED_KEEPS_LIMITS = 1e-8
"""As CLAIM_KEEPS_LIMITS, for an answer with which a solver stopped at its limit of iterations.

Such an answer has no claim in its favour, so its limits must hold as well as those of a proven one.
"""

CLOSED_FORM_INSIDE = 1e-12
"""Largest distance of a closed-form answer outside a bound that it still keeps, relative to max(1, |bound|).

Smaller: rounding makes "nothing binds" false where the optimum is the closed form. Larger: ticks are counted
at which a limit binds a little, and their distance to the closed form is not rounding.
"""

# --- Comparisons (`taskopt bench`) --------------------------------------------------------------------

RATE_MET = 1e-9
"""Residual of a row in SciPy's bounded least squares up to which a rate counts as met [m/s].

Smaller: SciPy's own rounding rules cases out. Larger: cases count whose first level cannot be met, and even
strict levels seem to give something away.
"""

LIMIT_KEPT = 1e-9
"""Excess over a limit after an Euler step up to which the limit counts as kept [rad, rad/s, m].

Smaller: rounding in position, about 1e-15 over a period of 1e-3 s, is reported as a fault. Larger: a limit
that is ignored near its bound passes unnoticed.
"""

DIAGONAL_OF_UNDAMPED = 1e-12
"""Added to the diagonal of normal equations without damping, so that they have one solution.

Smaller: rounding in JᵀJ, about 1e-16, decides which solution a solver finds. Larger: it acts as damping, from
σ = 1e-6 on.
"""

REGRETTED = 1e-8
"""Regret of a level beyond which `taskopt bench run` says that an answer makes the level worse.

Smaller: answers that are as accurate as was asked for count as worse. Larger: priorities that weights give
away by little go unseen.
"""

# --- Active set: fast path ------------------------------------------------------------------------------

FAST_PATH_COVERED = 1e-6
"""Least diagonal cost of an unknown, relative to the largest, with which it is eliminated by its own cost.

Smaller: its inverse enters the reduced matrix and spoils the conditioning, so that the search runs instead.
Larger: more unknowns go into the Schur complement, which costs time.
"""

FAST_PATH_PIVOT = 1e-7
"""Least Cholesky pivot, relative to its diagonal entry, that the fast path accepts.

Smaller: rows that nearly depend on each other are solved by normal equations, which square the condition
number; one refinement repairs errors only down to a pivot of about 1e-8. Larger: the search runs where the
fast path would have been right.
"""

FAST_PATH_FEASIBLE = 1e-12
"""Violation of a bound, relative to max(1, |value|), that the fast path counts as none.

Smaller: rounding refuses answers that are right, and the search runs. Larger: a velocity that breaks a limit
by as much is sent without the search.
"""

FAST_PATH_SIGN = 1e-10
"""Multiplier of a held bound, relative to the largest term in the sum, whose sign the fast path ignores.

Smaller: rounding makes a bound that ties leave and join again, and the search runs. Larger: a bound is held
although the optimum lies inside.
"""

# --- Active set: search ---------------------------------------------------------------------------------

SEARCH_SIGN = 1e-14
"""Multiplier, relative to its terms, that counts as not zero; its rounding error is some 1e-16 of them.

Smaller: rounding decides which row is dropped, and the search wanders or cycles. Larger: near a singularity a
small but true multiplier is ignored, and the answer stays away from the optimum.
"""

SEARCH_FEASIBLE = 1e-12
"""Violation of a row, relative to its norm, with which it blocks a step or joins the working set.

Smaller: rows that tie are added in turn by rounding. Larger: the answer violates rows by as much.
"""

SEARCH_BOX = 1e-12
"""Largest distance by which an unknown may pass a bound, relative to max(1, |x|), before it blocks a step.

It is put back onto the bound in the end. Smaller: as for SEARCH_FEASIBLE. Larger: putting it back changes the
values of the other rows by as much.
"""

SEARCH_AGREE = 1e-9
"""Residual of a hard row, relative to its norm, with which hard rows still agree.

Smaller: hard rows that agree but for rounding are called contradictory. Larger: contradictions of that size
pass as an answer, which the certificate then refuses.
"""

SEARCH_PERTURBATION = 5e-10
"""Distance by which the second search moves bounds apart, relative to the norm of their row.

Smaller: rounding still makes them tie. Larger: the perturbed answer may violate the true bounds by more than
SEARCH_AGREE (it is moved by up to twice this).
"""

STILL_PERTURBED = 1e-11
"""Violation of a hard row or a bound that shows that x keeps the moved bounds of the second search.

Where neither x nor its working set fits the true bounds, x is taken from its enclosure in a proof. Smaller:
ticks whose x has rounding errors of that size take milliseconds for it. Larger: claimed answers are off by
that violation times the inverse of the weakest direction, which may be more than ACCURACY.
"""

PLAIN_CONTRADICTION = 1e-6
"""Relative violation of hard rows, in the best compromise, from which they contradict each other for certain.

Smaller: contradictions are looked at a second time, which takes up to a second. Larger: limits that agree but
for rounding, between numbers of very different size, count as a contradiction.
"""

SEARCH_MOVED = 1e-9
"""Step of an unknown, relative to max(1, |x|), after which dropped rows may be dropped again.

Smaller: a cycle of rounding steps counts as progress. Larger: rows stay locked although x has moved on.
"""

SEARCH_MOVED_PERTURBED = 1e-11
"""The same for the second search, in which steps between perturbed bounds are short but real.

Smaller: as for SEARCH_MOVED. Larger: steps between perturbed bounds, of about SEARCH_PERTURBATION, count as
none.
"""

DIGITS_LOST = 2e-7
"""Share of a row that no row before it has, below which x is taken from its enclosure in a proof.

It is multiplied by the largest |x_j|: rounding errors are as large as x, and grow by the inverse of the
share. Smaller: claimed answers are wrong by more than ACCURACY. Larger: ticks near a singularity take
milliseconds for digits that the search had right.
"""

# --- Poses, directions, targets -----------------------------------------------------------------------

ROTATION = 1e-6
"""Largest entry of RᵀR − I for which R counts as a rotation matrix.

Smaller: matrices from files and from single-precision software are refused. Larger: a sheared frame passes,
and errors of poses are wrong by that much.
"""

LAST_ROW = 1e-9
"""Largest deviation of the last row of a pose from 0 0 0 1.

Smaller: products of many poses may be refused for their rounding. Larger: a transposed or scaled matrix with
a small translation passes for a pose.
"""

UNIT_NORM = 1e-6
"""Largest deviation from 1 of the norm of a quaternion or (cos, sin) in q; within it they are normalised.

Smaller: configurations printed with seven digits are refused. Larger: a q in another convention may pass.
"""

REPRESENTATION_SINGULAR = 1e-6
"""Size of det T(φ) below which Euler angles count as being at a representation singularity.

Smaller: rates of the angles of more than 1e6 times the angular velocity are returned, with six digits lost.
Larger: orientations are refused at which the rates are still good to many digits.
"""

NO_ANGLE = 1e-8
"""Norm of a quaternion's vector part below which the angle over its sine is taken to be 1 exactly.

There the quotient is 1 to the last bit. Smaller: 0/0 near the identity. Larger: logarithms of small rotations
lose digits from (angle)² of this size on.
"""

SERIES_BELOW = 0.5
"""[rad] Angle below which the maps of SO(3) and SE(3) are summed as power series.

Smaller: differences such as 1 − α cancel, and digits are lost. Larger: the series, cut off after a fixed
number of terms, is no longer exact to the last bit.
"""

NO_DIRECTION = 1e-9
"""[m] Length below which a vector has no direction, so that a normal or an axis is refused.

Smaller: the direction of rounding errors is accepted. Larger: short but meant vectors are refused.
"""

RIGHT_ANGLE = 1e-6
"""Largest cosine between two directions that must be at right angles.

Smaller: directions given with six digits are refused. Larger: a circle visibly becomes an ellipse.
"""

AT_THE_END = 1e-9
"""[s] A path counts as ended from this long before its end, because i·dt may fall short of it by rounding.

Smaller: the sample at the end keeps its rate, and the open loop stays off by one step. Larger: only matters
for periods near that size.
"""

JOINT_RANGE = 1e-9
"""[rad, m] How far a joint may be outside its position limits and count as inside.

Smaller: rounding after a step that ends at the limit is reported. Larger: real violations go unreported.
"""

MODEL_UNCHANGED = 1e-12
"""[rad, m, rad/s, m/s, kg], absolute and relative: a smaller change of a model after its robot was made is
taken for rounding.

Smaller: a frame that is added later, which sums inertias anew, is refused. Larger: limits that somebody
tightened on the model are ignored.
"""

# --- Analysis of Jacobians: kinematics/analysis -----------------------------------------------------------

JACOBIAN_RANK = 1e-9
"""Singular value of a Jacobian, relative to its largest, below which a direction of velocity counts as lost.

Smaller: rounding of an arm at a singularity, about 1e-16, still counts, but postures that were typed with ten
digits do not. Larger: postures a nanometre beside a singularity count as singular.
"""

WRIST_AXES_MEET = 1e-6
"""Distance [m] by which wrist axes may pass each other and still count as meeting in a point.

Smaller: wrists from files with rounded angles are refused. Larger: offset wrists pass for spherical ones,
and arm and wrist singularities are told apart where they are not apart.
"""

CURVED = 1e-7
"""Curvature along a lost direction, relative to the largest second derivative, that counts as none.

Smaller: rounding makes a singularity inside the workspace one at its boundary. Larger: an arm whose folded
links differ by that share is taken to be able to pass.
"""

RATIO_FLOOR = 1e-9
"""Singular value, or torque of a unit force, relative to the largest singular value, that a ratio divides by.

Smaller: gradients of ratios at a singularity overflow. Larger: ratios a nanometre beside one are wrong.
"""

INTERNAL_MOTION = 1e-12
"""Largest error [m, rad] of the held rows at a posture of a sampled internal motion.

Smaller: Newton's method does not end, for rounding. Larger: the frame drifts along the motion.
"""

# --- Distances between solids -------------------------------------------------------------------------

COAL = 1e-12
"""Tolerance that Coal's iterations for distance and depth are asked for.

Smaller: they end at their limit of iterations more often. Larger: at Coal's own 1e-6, gradients of distances
between convex hulls are off by 5 %.
"""

COAL_RETRY = 1e-9
"""Tolerance for measuring a pair again for which Coal said NaN, or that solids far apart touch.

Distances are good to it even so. Smaller: the second try may run into the same rounding. Larger: a distance
that is visibly less exact than its neighbours in time.
"""

NO_SLOPE = 1e-13
"""[m/rad, 1] Entry of a distance gradient below which it is set to zero, as for a wheel beside its own axle.

Smaller: rounding becomes a row that binds a joint without effect. Larger: real slopes of far joints vanish.
"""

SAME_POINT = 1e-8
"""[m] Distance below which both ends of a piece of a link are one point, so that it gets no capsule.

Smaller: links get capsules of no length. Larger: short pieces of links are missing from distances.
"""

# --- Tasks and limits ---------------------------------------------------------------------------------

BAND_CLOSED = 1e-6
"""Share of the blend below which the band of a task that comes or goes counts as closed (`During`).

Smaller: a band that only rounding keeps open makes two bounds of an equality. Larger: the last step of the
blend becomes a jump of that share of the reach.
"""

PARALLEL = 1e-9
"""Sine of the angle between two directions below which they count as parallel.

Smaller: the axis of a turn is made of rounding errors. Larger: a gaze that nearly looks at its target turns
about a wrong axis.
"""

OPPOSITE = 0.01
"""Least sine by which the rows of an axis that points the wrong way are divided (`AxisAlignmentTask`).

Smaller: near 180° one row becomes as large as 1/sine, and hides the other from the rank. Larger: around 180°,
in a cone of that size, the rows are no longer the exact derivative of the error.
"""

NEAREST_SIGHT = 0.01
"""Least length [m] of a line of sight in the row of a gaze; a nearer target turns as if it were here.

Smaller: the angle of a near target asks for very large velocities. Larger: near targets are followed too
slowly.
"""

CROSSED_BY_ROUNDING = 1e-9
"""Amount [rad/s, m/s], relative to max(1, |bound|), by which bounds of a velocity cross and still meet.

Bounds are distances over Δt, so that rounding errors of a position of 1e-16 grow with 1/Δt. Smaller: limits
that leave a joint exactly one velocity contradict each other by rounding. Larger: limits that do contradict
each other give way by half of it, unseen.
"""

CONTACT = 1e-9
"""Distance [m] beyond the margin below which a distance limit leaves a step this much to lose.

Smaller: v = 0 becomes the only velocity of a link at its margin, and solvers see a nearly empty set. Larger:
a link may go that far into its margin in one step.
"""

RESERVE_USED = 0.1
"""Share of the room before its margin within which a pair may brake as it may outside its reserve.

Smaller: links that are always near each other, such as the base and the upper arm of a UR10, hold the joints
between them by the facets of their meshes. Larger: a robot that pushes against what it touches comes nearer
to the margin, where its joints must be slower.
"""

JACOBI_ORTHOGONAL = 1e-15
"""Cosine of the angle between two rows below which the method of Jacobi takes them for orthogonal.

Smaller: it turns rounding errors to and fro. Larger: small singular values lose digits.
"""

JACOBI_DONE = 1e-12
"""Largest such cosine in a sweep after which the method of Jacobi stops; it converges quadratically.

Smaller: one sweep more than is needed. Larger: the singular values lose digits.
"""

# --- Static inverse kinematics: loop/pose --------------------------------------------------------------

GOAL_POSITION = 1e-6
"""[m] Error of a position up to which a goal counts as met, and depth inside a margin that does not count.

Smaller: Newton's method takes another step, and many more at a singularity, where it converges linearly.
Larger: a tool ends visibly beside its goal.
"""

GOAL_ORIENTATION = 1e-6
"""[rad] Error of an orientation up to which a goal counts as met.

Smaller: as for GOAL_POSITION. Larger: a tool is turned by that much, and its far end is off by that times
its length.
"""

GOAL_OTHER = 1e-6
"""Error of a goal that is neither in metres nor in radians, in its own unit, up to which it counts as met.

Smaller: as for GOAL_POSITION. Larger: the goal is met less exactly.
"""

MERIT_NOISE = 1e-9
"""Growth of the merit, relative, that is taken for rounding when a step of a descent is judged.

Smaller: steps at an optimum are halved many times for their rounding errors. Larger: a descent may climb by
that share on each of its steps, and stop where it is not at rest.
"""

POSTURE_AT_REST = 1e-6
"""[rad, m] Step of a joint up to which the levels below the goals count as being at rest.

They converge linearly. Smaller: more ticks for digits that nobody sees. Larger: the posture stops short of
the one that the lower levels ask for.
"""

STEP_STILL = 1e-9
"""[rad, m] Step of a joint up to which a descent has ended.

Smaller: a descent that is stuck halves its steps more often before it gives up. Larger: the least error of
a goal out of reach is found less exactly.
"""

# --- Records of a run: record -----------------------------------------------------------------------

SHOWN_VIOLATION = 1e-9
"""Excess over a limit [rad, m, rad/s, m/s] beyond which recordings and events show it as violated.

Smaller: answers of iterative solvers flicker at their limits. Larger: small violations are not seen.
"""

# --- Resolvers ----------------------------------------------------------------------------------------

TRANSPOSE_STUCK = 1e-9
"""Norm of Jᵀ K e, relative to the norms of J and K e, below which the transposed Jacobian counts as stuck.

Smaller: at a singularity that is off by rounding the note is missing. Larger: an arm that still moves, if
slowly, is said to be stuck.
"""

WEIGHT_SPREAD = 1e6
"""Weight of the first level over the weight of the norm in a weighted problem (`wqp/<solver>`).

Smaller: lower levels disturb higher ones more. Larger: rounding errors of the first level hide the last one,
and no answer in double precision can be proven.
"""

IN_RANGE = 1e-9
"""Distance of v from the range of J, relative to ‖v‖, up to which v counts as inside (`in_range`).

Smaller: rounding errors in J move a reachable v outside. Larger: an arm at a singularity is said to follow
velocities that it misses by that share.
"""

LEAST_ACCURACY = 1e-13
"""Smallest relative accuracy of x that a resolver may be asked for.

Smaller: no answer in double precision reaches it. Larger: users cannot ask for what double precision gives.
"""

SOLVER_SHARE = 1e-3
"""Share of the accuracy wanted in x that a solver is given as its tolerance, at unit size.

Solvers measure residuals in their own scaling and stop at the first that is small enough. Smaller: interior
points cannot reach the tolerance and give up. Larger: raw answers miss the accuracy.
"""

OUT_OF_REACH = 1e3
"""Bound over the expected size of x beyond which a program is first solved without it.

The answer is checked against it, and it is put back where it is broken. Smaller: programs whose x is larger
than expected are solved twice. Larger: interior points lose digits to bounds that nothing comes near.
"""

DIVERGED = 1e15
"""Number in the answer to a program of unit size from which on the answer is none.

Smaller: multipliers of rows that are nearly parallel count as diverged. Larger: their products overflow.
"""

NEAR_OPTIMUM = 1e-3
"""Natural residual, at unit size, below which an answer is refined.

Smaller: interior points that gave up a little early are not mended. Larger: programs without an answer are
solved several times before it is said that they have none.
"""

CLAIM_SHARE = 0.1
"""Natural residual over the accuracy wanted in x, at unit size, up to which an answer is claimed.

Smaller: right answers to programs of a large condition are not claimed. Larger: wrong ones are.
"""

ROUNDING_SHARE = 1e-15
"""Natural residual over the largest term of its sums that counts as rounding; about 5 units of roundoff.

Smaller: answers are refined for their rounding errors. Larger: errors of a solver pass for rounding.
"""

MOST_ZOOM = 1e6
"""Factor by which what an answer still misses is enlarged at most, before the solver is asked again.

Smaller: the second answer misses more. Larger: rounding errors of the first one, as large as 1e-16, exceed
the tolerance of the second program.
"""

HELD_MULTIPLIER = 1e3
"""Multiplier over the natural residual from which on a row is an equality when an answer is refined.

Smaller: rows at their bound with a multiplier of zero are held. Larger: the programs have larger gradients.
"""

ZOOMED_TOLERANCE = 1e-9
"""Tolerance for the enlarged program of what an answer still misses.

Smaller: interior points give up more often. Larger: more refinements are needed.
"""

UNFINISHED_VIOLATION = 1e-7
"""Violation of a hard limit, relative, above which an answer that a solver did not finish is no answer.

Smaller: answers that stopped near their limit of iterations are thrown away. Larger: velocities outside the
limits are sent to a robot.
"""

LEVEL_VIOLATION = 1e-9
"""Violation, relative to the largest term of its row, from which a level's row is frozen in `hqp/<solver>`.

Smaller: rows that are met to the accuracy of the solver are frozen and take freedom from lower levels.
Larger: a violated row stays an inequality that cannot be met, and lower levels find no feasible point.
"""

LEVEL_MULTIPLIER = 1e-6
"""Multiplier, relative to the largest of its level, from which a row at its bound is frozen for lower levels.

Smaller: rows to which a solver gave a wrong tiny multiplier are frozen and take freedom from lower levels.
Larger: rows stay inequalities although they can hold with equality only. Exact arithmetic gives the same
answer then, but programs whose feasible set has no interior are harder for solvers.
"""

REDUNDANT_ROW = 1e-9
"""Share of its norm that a row keeps in the null space of the levels before, up to which it is redundant.

Smaller: rows that are rounding errors enter the programs and freeze directions. Larger: rows that depend
weakly on the levels before are not kept.
"""

SHORT_ROW = 1e-3
"""Length of a row over the longest of its level, from which on down it may be lost for its length (`hqp`).

Smaller: an answer that leaves out a short row is claimed. Larger: rows in m and rad, near a singularity, are
compared as well, for nothing.
"""

INVISIBLE_ROW = 1e-8
"""Length of a row over the longest of its level, below which least squares do not see it (`hqp`).

Smaller: answers are claimed although the squares of its residuals are rounding errors of the others. Larger:
right answers are not claimed.
"""

THIN_DIRECTION = 1e-3
"""Singular value, relative to the largest, below which a direction keeps the unit of that value (`hqp`).

Smaller: in the unit 1/σ all rows look parallel to a solver. Larger: proximal steps along such directions get
short, and more of them are needed.
"""

PROXIMAL_STEP = 1e-12
"""Step of the proximal iteration, relative to its unknowns, at which it ends.

Smaller: it ends at the limit of repeats only. Larger: directions that a level leaves open stop short.
"""

PROXIMAL_NOISE = 1e-8
"""Proximal step, relative to its unknowns, below which it is rounding if it is longer than the one before it.

Smaller: rounding errors, which grow from step to step, are taken for a way that is left to go. Larger: the
iteration may end before a direction that levels barely see is reached.
"""

CVXPY_ROW_MET = 1e-9
"""Residual of an equality, relative to its largest term, up to which the CVXPY model takes it for met.

Smaller: levels that can be met are solved in least squares, whose condition is squared. Larger: levels that
cannot be met are stated as constraints.
"""

CVXPY_VIOLATION = 1e-7
"""Violation of an inequality, relative, from which the CVXPY model freezes it.

It is larger than LEVEL_VIOLATION because least squares in x, not scaled, end less accurately. Smaller: rows
that are met to the accuracy of the solver are frozen. Larger: violated rows stay inequalities.
"""

LIMITS_AGREE = 1e-9
"""Gap of a hard limit at the optimum of phase one, relative to its row and bound, up to which limits agree.

Smaller: limits that meet in one point, such as a box with lower = upper, are called contradictory. Larger:
limits that contradict each other are said to agree.
"""

GAP_NOISE = 1e-7
"""Gap of a hard limit relative to the largest gap, below which it is no member of the conflict.

Smaller: rounding errors are named in the least relaxation. Larger: limits without which the others can hold
are left out, and the relaxation does not suffice.
"""

RELAXATION_ROOM = 1e-6
"""Room that relaxed limits get beside the least relaxation, relative to max(1, |bound|).

Smaller: the feasible set is as thin as rounding errors, and solvers find no point in it. Larger: limits give
way by more than they have to.
"""

BROKEN_LIMIT = 1e-9
"""Violation of a hard limit by the brakes, in the unit of the limit, from which a note names it.

Smaller: rounding errors are named. Larger: small violations are not reported.
"""

DOUBTFUL_KEPT = 1e-8
"""Singular value, relative to its rows, below which a direction that was kept may be the cause of an error.

Smaller: answers near a singularity blame the solver. Larger: errors of a solver are blamed on the rank.
"""

DOUBTFUL_LOST = 1e-13
"""Singular value, relative to its rows, above which a direction that was given up may cause a difference.

Smaller: rounding errors are taken for directions. Larger: a difference that comes from the rank blames the
solver.
"""

# --- Damping at rest: hierarchy/rest, hierarchy/rank_doubt ----------------------------------------------

REST_LEAST = 1e-12
"""Threshold ε² below which nothing is damped, in the unit of the squared singular values.

Smaller: rounding errors of tasks that are met are taken for errors that remain. Larger: a robot whose target
is barely out of reach shakes by velocities of about ε/Δt over the lever arm.
"""

STANDS = 1e-9
"""Change of the value of a hard row that holds, from tick to tick, below which the last damping may be kept.

Smaller: ticks at which nothing moves any more are solved twice. Larger: the damping of a robot that slides
along an obstacle is that of the tick before.
"""

THRESHOLD_FOUND = 1e-3
"""Relative change of ε² in one round below which its fixed point is found.

Smaller: more rounds for digits that do not matter, since any ε² above the fixed point is stable. Larger: more
damping than is needed.
"""

BENDS = 1e-6
"""Share of ε² above which a second derivative of the cost takes a free direction for its level, at order 2.

Smaller: lower levels wait longer until a blocked level rests before they use its self-motions. Larger: they
throw an arm out of the best that the blocked level can do.
"""

OF_WEAK_DIRECTION = 0.5
"""Share of weak directions in a damped direction above which it is damped whatever its second derivative is.

Smaller: free directions are damped that no level needs. Larger: weak directions may swing.
"""

FREE_DIRECTION_WEIGHT = 1e4
"""Weight of the rows that damp the free directions of a blocked level, relative to the rows of their level.

Smaller: lower levels move on while the null space turns, and shake by the share that is left of their speed.
Larger: lower levels are held to rest more closely, and the level below is harder to solve.
"""

NEAR_LOSS = 0.05
"""Singular value of a level below which its bending may make the level below swing, relative to a lever arm.

Smaller: the posture of an arm may swing that has just reached a target near full stretch. Larger: robots with
high gains are damped on their way; 0.15 occurs on a circle of the Panda in the middle of its workspace.
"""

DEPENDENT_DIRECTION = 1e-9
"""Singular value of rows of length 1 below which they leave a direction free for damping.

Smaller: rows that depend up to rounding hold a direction, which is then not damped. Larger: directions that
are held to a small part are damped, too.
"""

ZERO_ROW = 1e-12
"""Length of a row, and of its right-hand side, below which the row asks for nothing at any posture.

Smaller: the third row of a planar arm's position, which is zero up to rounding, sends every tick through the
full search for directions to damp, and policies of damping take it for a singularity. Larger: a row that a
posture makes small is left out of both.
"""

WIDEST_BOUND = 1e-10
"""Error bound over max|x|, in the median of right answers, that `taskopt bench proof` asks for.

Smaller: answers of interior points, which end near 1e-12, miss it. Larger: bounds that have become wide pass.
"""

PLANTED_MULTIPLIER = 5e-9
"""Multiplier, relative to the scale of the first level, that `taskopt bench proof` plants on a bound.

Smaller: fewer lies free a sign, since noise hides their multipliers. Larger: KKT residuals show the lie.
"""

SAME_ROWS = 1e-9
"""Difference of rows from those of a log, relative and absolute, up to which they are of the same scenario.

Smaller: logs of another machine, whose rows differ by rounding, are not continued. Larger: a target or a gain
that was changed by little is not noticed.
"""
