"""Where a task is to be, and how fast that moves: x_d(t) with its rate ẋ_d(t).

Every reference gives its rate exactly, and tasks always use it: without this feedforward a moving
target is followed with a lag of ẋ_d/K. Past its end a reference holds, and its rate is zero from the
first held sample on; a sample more would leave a permanent error in an open loop (Sect. 3.7.5).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np

from taskopt.arrays import Array, ArrayLike, finite, positive
from taskopt.errors import InvalidValue, UnknownName
from taskopt.kinematics.space import PoseSpace, Space

# Brings value and rate, which the caller keeps between calls, to the time t [s], and says whether the rate
# is to be used (False: it is zero).
Course = Callable[[float, Array, Array], bool]

_NANOSECOND = 1e-9  # i·dt may fall short of the end by rounding; that sample is a held one
_FLOAT64 = np.dtype(np.float64)  # there is but one, and `is` is faster than ==
_STEP = 2e-5  # [s] of the differences of `Function`: truncation and rounding both near 1e-9


@runtime_checkable
class Target(Protocol):
    """A declaration; `start` turns it into the course of one task in one run."""

    def start(self, space: Space, start: Array, t: float) -> Course:
        """The course that begins at the value `start` at the time t [s]."""
        ...


@dataclass(frozen=True, eq=False)
class Hold:
    """Stay at `value`, or, without one, where the run starts."""

    value: Any = None

    def start(self, space: Space, start: Array, t: float) -> Course:  # noqa: ARG002 (protocol)
        held = start.copy() if self.value is None else space.convert(self.value, start)
        written = False

        def course(t: float, value: Array, rate: Array) -> bool:  # noqa: ARG001 (protocol)
            nonlocal written
            if not written:
                value[...] = held
                written = True
            return False

        return course


def _trapezoidal(u: float) -> tuple[float, float]:
    """Constant acceleration for a quarter of the time, cruise, and the mirror image."""
    if u < 0.25:
        return 8.0 / 3.0 * u * u, 16.0 / 3.0 * u
    if u <= 0.75:
        return (4.0 * u - 0.5) / 3.0, 4.0 / 3.0
    return 1.0 - 8.0 / 3.0 * (1.0 - u) ** 2, 16.0 / 3.0 * (1.0 - u)


# Timing laws: from u in [0, 1] to (s, ds/du), s from 0 to 1.
TIMING: dict[str, Callable[[float], tuple[float, float]]] = {
    "linear": lambda u: (u, 1.0),
    "cubic": lambda u: (u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u)),
    "quintic": lambda u: (u**3 * (10.0 - 15.0 * u + 6.0 * u * u), 30.0 * (u * (1.0 - u)) ** 2),
    "sinusoidal": lambda u: (0.5 - 0.5 * math.cos(math.pi * u), 0.5 * math.pi * math.sin(math.pi * u)),
    "trapezoidal": _trapezoidal,
}


@dataclass(frozen=True, eq=False)
class Line:
    """From where the run starts straight to the value `to`, or by the displacement `by`, in `duration` [s].

    Positions move on a straight line while orientations turn about a fixed axis of the world, and
    postures move at fixed ratios of joint velocities. `timing` is the law s(t/duration): "linear"
    (speed jumps at both ends), "cubic" (zero speed there), "quintic" (zero acceleration too),
    "sinusoidal" or "trapezoidal". Raises `InvalidValue` unless exactly one of `to` and `by` is given.
    """

    to: Any = None
    by: Any = None
    duration: float = field(kw_only=True)
    timing: str = "cubic"

    def __post_init__(self) -> None:
        positive("duration", self.duration)
        if (self.to is None) == (self.by is None):
            raise InvalidValue(
                "a line needs either `to` or `by`, got " + ("both", "neither")[self.to is None]
            )
        if self.timing not in TIMING:
            raise UnknownName("timing law", self.timing, TIMING)

    def start(self, space: Space, start: Array, t: float) -> Course:
        if self.by is not None:
            delta = space.convert_rate(self.by)
        else:
            delta = space.difference(start, space.convert(self.to, start))
        law, begin, duration, start = TIMING[self.timing], t, self.duration, start.copy()

        def course(t: float, value: Array, rate: Array) -> bool:
            if not 0.0 <= t - begin <= duration - _NANOSECOND:
                space.move(start, delta if t > begin else 0.0 * delta, value)
                return False
            s, speed = law((t - begin) / duration)
            space.move(start, s * delta, value)
            np.multiply(delta, speed / duration, out=rate)
            return True

        return course


@dataclass(frozen=True, eq=False)
class Circle:
    """From where the run starts around a circle: p_d = p_0 + r [(1 − cos ωt) toward + sin ωt along].

    `radius` r [m], `period` 2π/ω [s]. `toward` points from the start to the centre and `along` is the
    direction of departure, both in the world and at right angles (their lengths do not matter). After
    `turns` turns it holds; None goes on for ever. The orientation stays that of the start.
    """

    radius: float
    period: float
    toward: ArrayLike = (0.0, 0.0, 1.0)
    along: ArrayLike = (0.0, 1.0, 0.0)
    turns: float | None = None

    def __post_init__(self) -> None:
        positive("radius", self.radius)
        positive("period", self.period)
        if self.turns is not None:
            positive("turns", self.turns)
        toward, along = _unit("toward", self.toward), _unit("along", self.along)
        if abs(toward @ along) > 1e-6:
            raise InvalidValue(
                f"toward and along must be at right angles, their cosine is {toward @ along:.3g}"
            )

    def start(self, space: Space, start: Array, t: float) -> Course:
        if not isinstance(space, PoseSpace):
            raise InvalidValue("a circle is the path of a frame; joints take a Line or a Function")
        toward, along = _unit("toward", self.toward).tolist(), _unit("along", self.along).tolist()
        (x, y, z), r, omega = start[:3, 3].tolist(), float(self.radius), 2.0 * math.pi / self.period
        begin, pose = t, start.copy()
        end = math.inf if self.turns is None else self.turns * self.period

        def course(t: float, value: Array, rate: Array) -> bool:
            moving = 0.0 <= t - begin <= end - _NANOSECOND
            phase = omega * min(max(t - begin, 0.0), end)
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
            return moving

        return course


@dataclass(frozen=True, eq=False)
class Function:
    """Any x_d = value(t) of the run's time [s], with ẋ_d = derivative(t).

    Without `derivative` the rate comes from three values at t, t + 20 µs and t + 40 µs (second order,
    good to about 1e-9 for smooth functions of size one). They look forward only, so that a function
    that holds from some time on has no feedforward from that very sample on.
    """

    value: Callable[[float], Any]
    derivative: Callable[[float], Any] | None = None

    def __post_init__(self) -> None:
        for name in ("value", "derivative"):
            part = getattr(self, name)
            if not callable(part) and not (part is None and name == "derivative"):
                raise InvalidValue(f"{name} must be a function of time, got {part!r}")

    def start(self, space: Space, start: Array, t: float) -> Course:  # noqa: ARG002 (time is the run's)
        derivative, start = self.derivative, start.copy()

        def course(t: float, value: Array, rate: Array) -> bool:
            space.take(self.value(t), start, value)
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


class Latest:
    """The value that was set last, for control loops whose target somebody else moves.

    `set(value, velocity)` may be called at any time, also from another thread: a tick sees the old
    pair or the new one, never a mixture. Without `velocity` there is no feedforward. Before the first
    `set`, and without a value at the beginning, it holds where the run starts.
    """

    def __init__(self, value: Any = None) -> None:
        self._now: tuple[Array | None, Array | None] = (None, None)
        if value is not None:
            self.set(value)

    def set(self, value: Any, velocity: ArrayLike | None = None) -> None:
        """Move the target; what the value must be depends on the task, whose next tick checks it."""
        rate = None if velocity is None else _numbers("velocity", velocity)
        self._now = (_numbers("value", value), rate)

    def start(self, space: Space, start: Array, t: float) -> Course:  # noqa: ARG002 (it has no time)
        seen: tuple[Array | None, Array | None] | None = None
        start = start.copy()

        def course(t: float, value: Array, rate: Array) -> bool:  # noqa: ARG001 (it has no time)
            nonlocal seen
            now = self._now
            if now is not seen:
                if now[0] is None:
                    value[...] = start
                else:
                    space.take(now[0], start, value)
                if now[1] is not None:
                    space.take_rate(now[1], rate)
                seen = now
            return now[1] is not None

        return course


def as_target(value: Any) -> Target:
    """`value` itself if it is a reference, else `Hold(value)`."""
    return value if isinstance(value, Target) else Hold(value)


def _numbers(name: str, value: Any) -> Array:
    """A copy, whatever it is: an array, numbers, or a `pin.SE3`."""
    if value.__class__ is np.ndarray and value.dtype is _FLOAT64:
        return value.copy()
    try:
        return np.array(getattr(value, "homogeneous", value), dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidValue(f"{name} must be numbers, got {value!r}") from error


def _unit(name: str, value: ArrayLike) -> Array:
    vector = finite(name, value, (3,))
    length = float(np.linalg.norm(vector))
    if length < 1e-9:
        raise InvalidValue(f"{name} must be a direction, got {vector}")
    return vector / length
