"""Targets of tasks: the desired value x_d(t) with its rate ẋ_d(t).

Every target gives its exact rate, and tasks always use it: without this feedforward a moving target is
followed with a lag of ẋ_d/K. After its end a target holds its value. Its rate is zero from the first tick at
which the value is held; one more tick with a rate would leave a permanent error in an open loop (Sect.
3.7.5).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from inspect import signature
from typing import Protocol, cast, runtime_checkable

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite, positive
from taskopt.errors import InvalidValue, UnknownName
from taskopt.hierarchy.tolerances import AT_THE_END, NO_DIRECTION, RIGHT_ANGLE
from taskopt.kinematics.space import PoseSpace, Space, Value, plain

Course = Callable[[float, Array, Array], bool]
"""`course(t, value, rate)` writes the desired value and its rate at the time t [s] into the two arrays.

The caller keeps both arrays between calls. The course returns False where the rate is zero; it need not
write the rate then. For a stack of second order it takes a fourth array, by default None, into which it
writes ẍ_d, which has the size of the rate; where it returns False, it need not write it.
"""

FullCourse = Callable[[float, Array, Array, Array | None], bool]
"""A `Course` that also takes the fourth array, see `with_acceleration`."""

_FLOAT64 = np.dtype(np.float64)  # there is but one, and `is` is faster than ==
_STEP = 2e-5  # [s] of the differences of `Function`: truncation and rounding are both near 1e-9
_LONG_STEP = 2e-4  # [s] of the second differences of `Function`: truncation and rounding are both near 1e-7


@runtime_checkable
class Target(Protocol):
    """The declaration of a desired value x_d(t); `start` begins it for one task in one run."""

    def start(self, space: Space, start: Array, t: float) -> Course:
        """Begin the target, and return the function that computes its value and rate (its course).

        Args:
            space: Space of the value: poses of a frame, or postures of a robot.
            start: Value of the task at the start of the run: pose (4, 4) in the world [m], or posture (nq,).
            t: Time of the start [s].

        Returns:
            The course, a function of time that writes value and rate; it has its own copy of `start`.

        Raises:
            InvalidValue: The declared value does not fit the space.
            UnknownName: A mapping names a joint that the task does not have.
        """
        ...


@dataclass(frozen=True, eq=False)
class Hold:
    """A constant target.

    Attributes:
        value: A pose (`pin.SE3`, (4, 4)), position (3,) [m] or rotation (3, 3) in the world; or a posture, as
            `PostureSpace` takes it [rad, m]. None: the value at the start of the run.
    """

    value: Value | None = None

    def start(self, space: Space, start: Array, t: float) -> Course:  # noqa: ARG002 (protocol)
        """Begin the course at the time t [s], see `Target.start`.

        Raises:
            InvalidValue: The declared value does not fit the space.
        """
        held = start.copy() if self.value is None else space.convert(self.value, start)
        written = False

        def course(
            t: float,  # noqa: ARG001 (protocol)
            value: Array,
            rate: Array,  # noqa: ARG001 (protocol)
            acceleration: Array | None = None,  # noqa: ARG001 (protocol)
        ) -> bool:
            nonlocal written
            if not written:
                value[...] = held
                written = True
            return False

        return course


def _trapezoidal(u: float) -> tuple[float, float, float]:
    """Return (s, s', s''): constant acceleration for a quarter of the time, cruise, and the mirror image."""
    if u < 0.25:
        return 8.0 / 3.0 * u * u, 16.0 / 3.0 * u, 16.0 / 3.0
    if u <= 0.75:
        return (4.0 * u - 0.5) / 3.0, 4.0 / 3.0, 0.0
    return 1.0 - 8.0 / 3.0 * (1.0 - u) ** 2, 16.0 / 3.0 * (1.0 - u), -16.0 / 3.0


def _quintic(u: float) -> tuple[float, float, float]:
    """Return (s, s', s'') of the polynomial of degree 5 that begins and ends without acceleration."""
    left = u * (1.0 - u)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u * u), 30.0 * left**2, 60.0 * left * (1.0 - 2.0 * u)


def _sinusoidal(u: float) -> tuple[float, float, float]:
    """Return (s, s', s'') of half a turn of the cosine."""
    cosine, sine = math.cos(math.pi * u), math.sin(math.pi * u)
    return 0.5 - 0.5 * cosine, 0.5 * math.pi * sine, 0.5 * math.pi**2 * cosine


TIMING: dict[str, Callable[[float], tuple[float, float, float]]] = {
    "linear": lambda u: (u, 1.0, 0.0),
    "cubic": lambda u: (u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u), 6.0 - 12.0 * u),
    "quintic": _quintic,
    "sinusoidal": _sinusoidal,
    "trapezoidal": _trapezoidal,
}
"""Timing laws by name: functions of u = t/duration in [0, 1] that return s in [0, 1], ds/du and d²s/du²."""


def _check_timing(timing: str) -> None:
    """Raise `UnknownName` if there is no timing law of a name."""
    if not isinstance(timing, str) or timing not in TIMING:
        raise UnknownName("timing law", timing, TIMING)


@dataclass(frozen=True, eq=False)
class Line:
    """A straight motion from the value x_0 at the start of the run: x_d = x_0 ⊕ s(t/duration) Δ.

    Positions move on a straight line while orientations turn about a fixed axis of the world, and
    postures move at fixed ratios of joint velocities. Exactly one of `to` and `by` must be given.

    Attributes:
        to: Value at the end: a pose, position [m] or rotation in the world, or a posture [rad, m].
        by: Displacement Δ: for a frame (6,) or (3,) along the axes of the world [m, rad], or for joints.
        duration: Time from the start to the end [s], greater than zero.
        timing: The law s: "linear" (speed jumps at both ends), "cubic" (zero speed there), "quintic" (zero
            acceleration as well), "sinusoidal" or "trapezoidal".

    Raises:
        InvalidValue: Both or neither of `to` and `by` are given, or the duration is not positive.
        UnknownName: There is no timing law of that name.
    """

    to: Value | None = None
    by: Value | None = None
    duration: float = field(kw_only=True)
    timing: str = "cubic"

    def __post_init__(self) -> None:
        positive("duration", self.duration)
        if (self.to is None) == (self.by is None):
            given = "neither" if self.to is None else "both"
            raise InvalidValue(f"a line needs either `to` or `by`, got {given}")
        _check_timing(self.timing)

    def start(self, space: Space, start: Array, t: float) -> Course:
        """Begin the course at the time t [s], see `Target.start`.

        Raises:
            InvalidValue: `to` or `by` does not fit the space.
        """
        if self.to is not None:
            delta = space.difference(start, space.convert(self.to, start))
        else:
            assert self.by is not None, "__post_init__ has checked that one of them is given"
            delta = space.convert_rate(self.by)
        law, begin, duration, start = TIMING[self.timing], t, self.duration, start.copy()

        def course(t: float, value: Array, rate: Array, acceleration: Array | None = None) -> bool:
            if not 0.0 <= t - begin <= duration - AT_THE_END:
                space.move(start, delta if t > begin else 0.0 * delta, value)
                return False
            s, speed, change = law((t - begin) / duration)
            space.move(start, s * delta, value)
            np.multiply(delta, speed / duration, out=rate)
            if acceleration is not None:
                np.multiply(delta, change / duration**2, out=acceleration)
            return True

        return course


@dataclass(frozen=True, eq=False, kw_only=True)
class Circle:
    """A circle through the start p_0 of the run: p_d = p_0 + r [(1 − cos φ) toward + sin φ along].

    The angle is φ = 2π t/period. With a timing law s it is φ = 2π · turns · s(t/(turns · period)), so that a
    robot at rest can follow from the first tick and to the last one. The orientation stays that of the start.

    Attributes:
        radius: Radius r [m].
        period: Time of one turn [s], the mean of all turns.
        toward: Direction from the start to the centre, (3,) in the world; its length does not matter.
        along: Direction in which the circle begins, (3,) in the world, at right angles to `toward`.
        turns: Number of turns after which the target stands still; None means that it never stops.
        timing: The law s: "linear" (speed jumps at both ends), or one of the others of `Line`, which need a
            number of turns.

    Raises:
        InvalidValue: A number is not positive, the directions are not at right angles, or a timing law other
            than "linear" has no number of turns.
        UnknownName: There is no timing law of that name.
    """

    radius: float
    period: float
    toward: ArrayLike = (0.0, 0.0, 1.0)
    along: ArrayLike = (0.0, 1.0, 0.0)
    turns: float | None = None
    timing: str = "linear"

    def __post_init__(self) -> None:
        positive("radius", self.radius)
        positive("period", self.period)
        if self.turns is not None:
            positive("turns", self.turns)
        _check_timing(self.timing)
        if self.timing != "linear" and self.turns is None:
            raise InvalidValue(f"a circle with the timing law '{self.timing}' needs a number of `turns`")
        toward, along = unit("toward", self.toward), unit("along", self.along)
        if abs(toward @ along) > RIGHT_ANGLE:
            raise InvalidValue(
                f"toward and along must be at right angles, their cosine is {toward @ along:.3g}"
            )

    def start(self, space: Space, start: Array, t: float) -> Course:
        """Begin the course at the time t [s], see `Target.start`.

        Raises:
            InvalidValue: The task is a task of joints, for which a circle is no target.
        """
        if not isinstance(space, PoseSpace):
            raise InvalidValue("a circle is the path of a frame; for joints give a Line or a Function")
        along_centre, along_path = unit("toward", self.toward), unit("along", self.along)
        toward, along = along_centre.tolist(), along_path.tolist()
        (x, y, z), r, mean = start[:3, 3].tolist(), float(self.radius), 2.0 * math.pi / self.period
        begin, pose = t, start.copy()
        end = math.inf if self.turns is None else self.turns * self.period
        law = None if self.timing == "linear" else TIMING[self.timing]

        def course(t: float, value: Array, rate: Array, acceleration: Array | None = None) -> bool:
            moving = 0.0 <= t - begin <= end - AT_THE_END
            passed, omega, change = min(max(t - begin, 0.0), end), mean, 0.0
            if law is not None:
                s, speed, bend = law(passed / end)
                passed, omega, change = s * end, mean * speed, mean * bend / end
            phase = mean * passed
            a, b = r * (1.0 - math.cos(phase)), r * math.sin(phase)
            value[...] = pose
            value[0, 3] = x + a * toward[0] + b * along[0]
            value[1, 3] = y + a * toward[1] + b * along[1]
            value[2, 3] = z + a * toward[2] + b * along[2]
            if moving:
                da, db = omega * b, omega * (r - a)
                rate[0] = da * toward[0] + db * along[0]
                rate[1] = da * toward[1] + db * along[1]
                rate[2] = da * toward[2] + db * along[2]
                rate[3] = rate[4] = rate[5] = 0.0
                if acceleration is not None:
                    acceleration[:3] = (change * b + omega**2 * (r - a)) * along_centre
                    acceleration[:3] += (change * (r - a) - omega**2 * b) * along_path
                    acceleration[3:] = 0.0
            return moving

        return course


@dataclass(frozen=True, eq=False)
class Function:
    """A target that is any function of the run's time, x_d = value(t) and ẋ_d = derivative(t).

    Without `derivative` the rate is computed from three values at t, t + 20 µs and t + 40 µs, to second
    order, with errors of about 1e-9 for smooth functions of size one. The differences look forward only, so
    that the rate of a function that becomes constant is zero from the first constant tick on. In a stack of
    second order, ẍ_d without `second_derivative` is computed in the same way from three values of
    `derivative`, or with errors of about 1e-7 from four values within 0.6 ms if there is none.

    Attributes:
        value: Function of t [s] that returns a pose (4, 4), position (3,) [m] or rotation (3, 3) in the
            world, or a posture (nq,) [rad, m].
        derivative: Function of t [s] that returns the rate: (6,) or (3,) along the axes of the world [m/s,
            rad/s], or joint velocities (nv,) [rad/s, m/s]. None: by differences.
        second_derivative: Function of t [s] that returns the rate of that rate [m/s², rad/s²]. None: by
            differences. Only a stack of second order calls it.

    Raises:
        InvalidValue: One of them is not callable.
    """

    value: Callable[[float], Value]
    derivative: Callable[[float], Value] | None = None
    second_derivative: Callable[[float], Value] | None = None

    def __post_init__(self) -> None:
        if not callable(self.value):
            raise InvalidValue(f"value must be a function of time, got {self.value!r}")
        for name in ("derivative", "second_derivative"):
            function = getattr(self, name)
            if function is not None and not callable(function):
                raise InvalidValue(f"{name} must be a function of time, got {function!r}")

    def __deepcopy__(self, memo: dict[int, object]) -> "Function":
        return self  # frozen; a copy of a function is the function itself

    def __reduce__(self) -> tuple[type["Function"], tuple[object, object, object]]:
        parts = self.value, self.derivative, self.second_derivative
        for name in (getattr(part, "__qualname__", "") for part in parts):
            if "<" in name:
                raise InvalidValue(
                    f"a target whose function is {name} cannot be pickled; define the function at the top "
                    "level of a module"
                )
        return Function, parts

    def start(self, space: Space, start: Array, t: float) -> Course:  # noqa: ARG002 (time is the run's)
        """Begin the course at the time t [s], see `Target.start`."""
        derivative, start = self.derivative, start.copy()

        def course(t: float, value: Array, rate: Array, acceleration: Array | None = None) -> bool:
            space.take(self.value(t), start, value)
            if acceleration is not None:
                acceleration[:] = self._acceleration(space, t, value, start)
            if derivative is not None:
                space.take_rate(derivative(t), rate)
                return True
            one, two = t + _STEP, t + 2.0 * _STEP
            after = space.difference(value, space.convert(self.value(one), start))
            later = space.difference(value, space.convert(self.value(two), start))
            h, k = one - t, two - t  # what the rounded times really differ by
            rate[:] = (after * k * k - later * h * h) / (h * k * (k - h))
            return True

        return course

    def _acceleration(self, space: Space, t: float, value: Array, start: Array) -> Array:
        """Return ẍ_d at the time t [s], (tangent,), given or by differences that look forward."""
        if self.second_derivative is not None:
            return space.convert_rate(self.second_derivative(t))
        if self.derivative is not None:
            now, one, two = (space.convert_rate(self.derivative(t + i * _STEP)) for i in range(3))
            return (4.0 * one - 3.0 * now - two) / (2.0 * _STEP)
        one, two, three = (
            space.difference(value, space.convert(self.value(t + i * _LONG_STEP), start)) for i in (1, 2, 3)
        )
        return (4.0 * two - 5.0 * one - three) / _LONG_STEP**2


@dataclass(frozen=True, eq=False)
class WithoutRate:
    """A target whose rate ẋ_d is left out, so that the task asks for K e alone and lags behind.

    Attributes:
        target: The target, or a value to hold.

    Source:
        The scheme of Fig. 3.12, which has no feedforward.
    """

    target: "Target | Value"

    def start(self, space: Space, start: Array, t: float) -> Course:
        """Begin the course at the time t [s], see `Target.start`.

        Raises:
            InvalidValue: The declared value of the inner target does not fit the space.
        """
        inner = as_target(self.target).start(space, start, t)

        def course(t: float, value: Array, rate: Array, acceleration: Array | None = None) -> bool:  # noqa: ARG001
            inner(t, value, rate)
            return False

        return course


class Latest:
    """A target whose value is set while the stack runs, such as by an operator or another program.

    `set` may be called at any time, also from another thread: a tick sees the old value and velocity or the
    new ones, never a mixture. If no value is given at first, the target is the value at the start of the run
    until the first `set`.
    """

    def __init__(self, value: Value | None = None) -> None:
        """Make the target.

        Args:
            value: A pose, position [m] or rotation in the world, or a posture [rad, m]. None: the value at
                the start.

        Raises:
            InvalidValue: The value is not numeric.
        """
        self._now: tuple[tuple[Array | None, Array | None], Array | None] = ((None, None), None)
        if value is not None:
            self.set(value)

    def set(
        self, value: Value, velocity: ArrayLike | None = None, acceleration: ArrayLike | None = None
    ) -> None:
        """Set a new value; the task checks at the next tick that it fits.

        Args:
            value: A pose, position [m] or rotation in the world, or a posture [rad, m].
            velocity: Rate of the value: (6,) or (3,) along the axes of the world [m/s, rad/s], or joint
                velocities (nv,) [rad/s, m/s]. None: no feedforward.
            acceleration: Rate of that rate, which a stack of second order feeds forward [m/s², rad/s²]. None:
                zero.

        Raises:
            InvalidValue: One of them is not numeric, or an acceleration is given without a velocity.
        """
        if acceleration is not None and velocity is None:
            raise InvalidValue("a target with an acceleration needs its velocity, too")
        rate = None if velocity is None else _numbers("velocity", velocity)
        change = None if acceleration is None else _numbers("acceleration", acceleration)
        self._now = (_numbers("value", value), rate), change

    @property
    def now(self) -> tuple[Array | None, Array | None]:
        """Value and velocity that were set last, in a new tuple for each `set`; (None, None) before it."""
        return self._now[0]

    def start(self, space: Space, start: Array, t: float) -> Course:  # noqa: ARG002 (it has no time)
        """Begin the course at the time t [s], see `Target.start`."""
        seen: tuple[tuple[Array | None, Array | None], Array | None] | None = None
        written: Array | None = None  # the array that has the rate
        start = start.copy()

        def course(t: float, value: Array, rate: Array, acceleration: Array | None = None) -> bool:  # noqa: ARG001
            nonlocal seen, written
            now = self._now
            (latest, velocity), change = now
            if now is not seen or rate is not written:
                if latest is None:
                    value[...] = start
                else:
                    space.take(latest, start, value)
                if velocity is not None:
                    space.take_rate(velocity, rate)
                if acceleration is not None:
                    acceleration[:] = 0.0
                    if change is not None:
                        space.take_rate(change, acceleration)
                seen, written = now, rate
            return velocity is not None

        return course


def with_acceleration(course: Course, name: str) -> FullCourse:
    """Check that a course can write ẍ_d, as a stack of second order needs it.

    Args:
        course: The course.
        name: Name of the task, for the message.

    Returns:
        The same course.

    Raises:
        InvalidValue: It takes three arguments only.
    """
    try:
        signature(course).bind(0.0, None, None, None)
    except TypeError:
        raise InvalidValue(
            f"the target of '{name}' gives no acceleration, which a stack of order 2 needs: its course must "
            "take a fourth argument, acceleration=None, and write ẍ_d into it where it is an array"
        ) from None
    return cast("FullCourse", course)


def as_target(value: Target | Value | None) -> Target:
    """Convert the argument `target` of a task to a `Target`.

    Args:
        value: A target, or a constant value; None stands for the value at the start of the run.

    Returns:
        The target itself, or `Hold(value)`.
    """
    return value if isinstance(value, Target) else Hold(value)


_ANYWHERE = np.eye(4)


def check_target(target: Target | Value | None, space: Space, start: Array = _ANYWHERE) -> None:
    """Check the argument `target` of a task where it is a constant value; others are known when they begin.

    Args:
        target: A target, a constant value, or None.
        space: The space of the values.
        start: A value at which a run may start.

    Raises:
        InvalidValue: The value is of no form that the space takes.
    """
    value = target.value if isinstance(target, Hold) else target
    if value is not None and not isinstance(value, Target):
        space.convert(value, start)


def _numbers(name: str, value: Value) -> Array:
    """Copy the numbers of a value, whatever form it has; the space checks later that they fit."""
    if isinstance(value, np.ndarray) and value.dtype is _FLOAT64:
        return value.copy()
    try:
        return np.array(plain(value), dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidValue(f"{name} must be numbers, got {value!r}") from error


def unit(name: str, value: ArrayLike) -> Array:
    """Scale a vector to length 1.

    Args:
        name: Name of the value in messages.
        value: The vector, (3,).

    Returns:
        Its direction, (3,).

    Raises:
        InvalidValue: The vector is not three finite numbers, or is too short to have a direction.
    """
    vector = finite(name, value, (3,))
    length = float(np.linalg.norm(vector))
    if length < NO_DIRECTION:
        raise InvalidValue(f"{name} must be a direction, got {vector}")
    return vector / length
