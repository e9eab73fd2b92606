"""`record`, with which any loop logs its ticks: one that calls a resolver, or one with velocities only."""

from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

import numpy as np

from taskopt.arrays import ArrayLike, finite, positive
from taskopt.errors import InvalidValue
from taskopt.hierarchy.problem import Hierarchy
from taskopt.hierarchy.resolution import Resolution
from taskopt.hierarchy.status import Status
from taskopt.hierarchy.tolerances import COUNTED_MULTIPLIER
from taskopt.kinematics.robot import Robot
from taskopt.log.description import Description
from taskopt.log.of_plan import coordinates, robot_facts
from taskopt.log.provenance import Json
from taskopt.log.raw import RawLog, Tick, checked_path
from taskopt.log.ring import End
from taskopt.resolver.base import Memory, Resolver, answered_by_x


class HierarchyLog:
    """The log of a loop of one's own, see `record`; as a context it is closed at the end.

    The file is made at the first tick, whose hierarchy has the names and sizes of all.

    Args:
        path: The file.
        dt: Time between two ticks [s].
        resolver: What answers.
        robot: The robot, for names and limits of joints.
        facts: More facts for the metadata, as plain data for JSON.
    """

    def __init__(
        self,
        path: str | Path,
        dt: float,
        resolver: str | Resolver,
        robot: Robot | None,
        facts: Mapping[str, Json],
    ) -> None:
        self.path, self._dt, self._robot = checked_path(path), positive("dt", dt), robot
        if not self.path.parent.is_dir():
            raise InvalidValue(f"cannot write the log {path}: {self.path.parent} is no folder")
        self._resolver = _Named(resolver) if isinstance(resolver, str) else resolver
        self._facts = {"dt_s": dt, **facts}
        self._log: RawLog | None = None
        self._first: tuple[Hierarchy, int] | None = None

    @property
    def count(self) -> int:
        """Number of ticks that are in the log, or on their way."""
        return 0 if self._log is None else self._log.count

    def add(
        self,
        answer: Resolution | ArrayLike,
        t: float,
        q: ArrayLike | None = None,
        *,
        hierarchy: Hierarchy | None = None,
        memory: Memory | None = None,
        v_before: ArrayLike | None = None,
        error: str = "",
    ) -> None:
        """Log a tick.

        Args:
            answer: The resolution; or the unknowns that were sent, (n,), as a rule velocities [rad/s, m/s].
                Unknowns get the multipliers that fit them best, which takes about a millisecond.
            t: Time [s].
            q: Posture, (nq,) [rad, m]; at all ticks or at none.
            hierarchy: The problem; None for that of the resolution.
            memory: Memory that the resolver began with, so that the tick can be solved again to the last bit.
            v_before: Velocity before the tick, (n,); None if it is what the tick before sent, or unknown.
            error: The error that the tick raised, so that nothing was sent; "" for none.

        Raises:
            InvalidValue: Unknowns come without a hierarchy, a size is wrong, or names, sizes or norm of the
                hierarchy are not those of the first tick.
            LogFailed: The log cannot be written any more, as on a full disk.
        """
        if not isinstance(answer, Resolution):
            answer = _of_unknowns(answer, hierarchy)
        elif answer.is_damped:
            answer = _as_sent(answer)
        declared = answer.problem if hierarchy is None else hierarchy
        posture = None if q is None else np.asarray(q, dtype=np.float64)
        log = self._opened(declared, 0 if posture is None else posture.size)
        before = None if v_before is None else finite("v_before", v_before, (declared.n,))
        tick = Tick(log.count, t, self._dt, posture, before, memory, self._base)
        log.add(tick, answer, declared, error)

    def close(self, why: str = "") -> None:
        """Wait until everything is in the file, and close it; closing twice does nothing.

        Args:
            why: What interrupted the loop; "" if nothing did.

        Raises:
            LogFailed: Not everything could be written.
        """
        if self._log is not None:
            self._log.close(End.INTERRUPTED if why else End.FINISHED, why)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None
    ) -> None:
        self.close("" if kind is None else str(error) or kind.__name__)

    def _opened(self, declared: Hierarchy, nq: int) -> RawLog:
        """Return the log, which the first tick opens."""
        if self._log is not None and self._first is not None:
            first, size = self._first
            if declared.layout != first.layout or not np.array_equal(declared.norm, first.norm):
                raise InvalidValue("names, sizes and norm of a hierarchy must be those of the first tick")
            if nq != size:
                raise InvalidValue(f"q must have {size} numbers as at the first tick, got {nq}")
            return self._log
        facts, names = dict(self._facts), (tuple(f"q{i}" for i in range(nq)), ("",) * nq)
        if self._robot is not None:
            facts["robot"] = robot_facts(self._robot)
            names = coordinates(self._robot) if nq else ((), ())
            if nq not in (0, self._robot.nq):
                raise InvalidValue(f"q must have {self._robot.nq} numbers for this robot, got {nq}")
        own = (self._resolver,)
        described = Description(declared.layout, declared.norm, own, None, *names, facts=facts)
        self._first = declared.copy(), nq
        self._base = np.repeat([[-np.inf], [np.inf], [0.0], [0.0]], declared.n, axis=1)  # no bound is known
        self._log = RawLog(self.path, described)
        return self._log


def record(
    path: str | Path,
    *,
    dt: float,
    resolver: str | Resolver = "own",
    robot: Robot | None = None,
    facts: Mapping[str, Json] | None = None,
) -> HierarchyLog:
    """Log the ticks of a loop of one's own, which calls a resolver or has velocities only.

        with taskopt.record("run.arrow", dt=1e-3, resolver="active-set", robot=robot) as log:
            for k in range(1000):
                hierarchy, before = plan.at(q, 1e-3 * k), memory
                resolution, memory = resolver(hierarchy, before)
                log.add(resolution, 1e-3 * k, q, memory=before)

    A `Controller` and `run` have `log=` for that, which also logs errors of tasks, poses and damping, and
    costs a tick less.

    Args:
        path: File that ends in .arrow; one that exists is replaced. The file is made at the first tick.
        dt: Time between two ticks [s].
        resolver: What answers: a resolver, or its name, by which `solve_again` finds it; any other name if
            velocities come from elsewhere.
        robot: The robot, for names and limits of joints; None if there is none.
        facts: More facts for the metadata, as plain data for JSON.

    Returns:
        The log, a context.

    Raises:
        InvalidValue: The name ends in something else, its folder takes no files, or dt ≤ 0.
    """
    return HierarchyLog(path, dt, resolver, robot, facts or {})


class _Named(NamedTuple):
    """What answers, if it is no resolver of taskopt: a log needs its name only."""

    name: str


def _of_unknowns(answer: ArrayLike, hierarchy: Hierarchy | None) -> Resolution:
    """Return unknowns as a resolution that claims nothing, with the multipliers that fit them best."""
    if hierarchy is None:
        raise InvalidValue("velocities need their hierarchy: log.add(v, t, q, hierarchy=...)")
    x = np.asarray(answer, dtype=np.float64)
    if x.shape != (hierarchy.n,):
        raise InvalidValue(f"the answer must be a Resolution or {hierarchy.n} numbers, got {answer!r}")
    return answered_by_x(hierarchy, x, Status.FORMULA, counted=COUNTED_MULTIPLIER)


def _as_sent(damped: Resolution) -> Resolution:
    """Return a damped answer as one to the problem without damping, which is the one that was declared."""
    assert damped.undamped is not None
    plain = answered_by_x(damped.undamped.problem, damped.x, Status.FORMULA, counted=COUNTED_MULTIPLIER)
    return plain.replaced(notes=(*damped.notes, "damped, so that the robot comes to rest"))
