"""The ticks of one resolver of a log as columns, with the figures that follow from them."""

from functools import cached_property

import numpy as np

from taskopt.arrays import NO_BOUND, AnyArray, Array, IntArray, Mask
from taskopt.errors import InvalidValue
from taskopt.hierarchy.layout import Block
from taskopt.hierarchy.tolerances import SHOWN_VIOLATION
from taskopt.log.breaches import values_and_limits
from taskopt.log.reading import Log

_PERCENTILE = 95.0  # of the solve times: above it is what the scheduler took


class Answers:
    """k ticks of one resolver, in the order of time, each column read or computed at the first access.

    Args:
        log: The log.
        resolver: Name of the resolver.

    Attributes:
        log: The log.
        resolver: Name of the resolver.
        rows: Numbers of its rows in the log, (k,).

    Raises:
        UnknownName: There is no such resolver.
        InvalidValue: The resolver has no tick, or its answers are accelerations.
    """

    def __init__(self, log: Log, resolver: str) -> None:
        self.log, self.resolver = log, resolver
        self.rows: IntArray = log.rows(resolver)
        if not len(self.rows):
            raise InvalidValue(f"{resolver} has no tick in {log.path}")
        if log.layout.is_of_accelerations:
            raise InvalidValue(f"{log.path} is of order 2, which has no layout yet; see taskopt show")
        if "q" not in log.columns or "tree" not in log.facts.get("robot", {}):
            raise InvalidValue(
                f"{log.path} has no postures or no robot to draw, as logs of hierarchies or of version 0.2.0 "
                "and before; see taskopt show"
            )

    def column(self, name: str) -> AnyArray:
        """Return a column of the log.

        Args:
            name: Its name.

        Returns:
            (k,) or (k, m).
        """
        return self.log.array(name)[self.rows]

    @cached_property
    def index(self) -> IntArray:
        """Numbers of the ticks, (k,)."""
        return self.column("tick").astype(np.int64)

    @cached_property
    def t(self) -> Array:
        """Times, (k,) [s]."""
        return self.log.t[self.rows]

    @cached_property
    def time(self) -> AnyArray:
        """Times in whole nanoseconds, (k,), so that rows of different columns join."""
        return np.rint(1e9 * self.t).astype(np.int64).astype("timedelta64[ns]")

    @cached_property
    def end(self) -> float:
        """Time at which the last tick ends [s]."""
        return float(self.t[-1] + self.column("dt")[-1])

    @cached_property
    def q(self) -> Array:
        """Postures, (k, nq) [rad, m]."""
        return self.column("q")

    @cached_property
    def x(self) -> Array:
        """Velocities that were sent, (k, n) [rad/s, m/s]."""
        return self.column("x")

    @cached_property
    def failed(self) -> Mask:
        """True for ticks that raised an error, at which nothing was sent, (k,)."""
        return self.column("failed").astype(bool)

    def ticks_every(self, period: float) -> IntArray:
        """Find the ticks on multiples of a period, and the last one.

        Args:
            period: The period [s].

        Returns:
            Their places, which depend on the numbers of the ticks only.
        """
        every = max(1, round(period / float(self.column("dt")[0])))
        found = np.flatnonzero(self.index % every == 0)
        return np.union1d(found, [len(self.index) - 1])

    def error(self, block: Block) -> Array:
        """Return e = x_d − x of a task, NaN while none of its rows has a bound.

        Args:
            block: The rows of the task.

        Returns:
            (k, m), each in the unit of its row without "/s".
        """
        bounds, count = self.column("bounds"), self.log.layout.row_count
        asked = np.isfinite(bounds[:, block.rows]) | np.isfinite(bounds[:, count:][:, block.rows])
        return np.where(asked.any(axis=1, keepdims=True), self.column(f"error/{block.name}"), np.nan)

    @cached_property
    def tasks(self) -> tuple[Block, ...]:
        """The rows of each task that has an error."""
        known = self.log.facts["tasks"]
        return tuple(block for block in self.log.layout.blocks if block.level and block.name in known)

    @cached_property
    def beyond(self) -> IntArray:
        """Bounds and hard rows that x breaks, (k, n + M): −1 below the lower one, +1 above the upper one."""
        value, lower, upper = values_and_limits(self.log, self.rows)
        side = np.zeros((len(self.rows), self.log.layout.width), dtype=np.int64)
        own = side[:, : value.shape[1]]
        own += value > upper + SHOWN_VIOLATION
        own -= value < lower - SHOWN_VIOLATION
        side[self.failed] = 0
        return side

    @cached_property
    def velocity_share(self) -> Array:
        """Velocities within the bounds that do not depend on the posture, −1 to 1 in them, (k, n).

        Bounds are those of the stack, else those of the robot; NaN where there is neither.
        """
        n, stated = self.log.layout.n, self.log.facts["robot"]["velocity_limit"]
        robot = np.array([np.inf if most is None else most for most in stated])
        base = self.column("base_box")
        lower = np.where(base[:, :n] > -NO_BOUND, base[:, :n], -robot)
        upper = np.where(base[:, n : 2 * n] < NO_BOUND, base[:, n : 2 * n], robot)
        return _share(self.x, lower, upper)

    @cached_property
    def position_share(self) -> Array:
        """Positions within the robot's limits, −1 at the lower and 1 at the upper one, (k, n); else NaN."""
        facts = self.log.facts["robot"]
        index = np.array(facts["position_index"])
        lower, upper = (
            np.array([bound if value is None else value for value in facts[f"position_{side}"]])
            for side, bound in (("lower", -np.inf), ("upper", np.inf))
        )
        q = np.where(index >= 0, self.q[:, index], np.nan)
        return _share(q, lower, upper)

    @cached_property
    def microseconds(self) -> Array:
        """Times in the resolver, (k,) [µs]; NaN where they were not measured."""
        return 1e6 * self.column("seconds").astype(np.float64)

    @cached_property
    def usual_microseconds(self) -> float:
        """The 95th percentile of the times [µs], which a few long ones do not move; 0 without any."""
        known = self.microseconds[np.isfinite(self.microseconds)]
        return float(np.percentile(known, _PERCENTILE)) if len(known) else 0.0


def _share(value: Array, lower: Array, upper: Array) -> Array:
    """Return (2 value − lower − upper)/(upper − lower), NaN unless both bounds are finite and differ."""
    with np.errstate(invalid="ignore", divide="ignore"):
        share = (2.0 * value - lower - upper) / (upper - lower)
    return np.where(np.isfinite(upper - lower) & (upper > lower), share, np.nan)
