"""All of a run but the resolver: robot, start, stack, duration, period. One Python file in `tasks/`."""

import sys
from dataclasses import dataclass, replace
from difflib import get_close_matches
from importlib.util import module_from_spec, spec_from_file_location
from inspect import cleandoc
from pathlib import Path

from numpy.typing import ArrayLike

from taskopt.arrays import Array, positive
from taskopt.errors import InvalidValue, MissingFile
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.stack import Stack
from taskopt.resolver.infeasible import ConflictPolicy, checked_policy

SHELF = Path("tasks")


@dataclass(frozen=True, eq=False, kw_only=True)
class Scenario:
    """A robot that starts at q0 and follows a stack for `duration` [s] in steps of `dt` [s].

    `on_conflict`: what to do at a tick whose hard limits contradict each other, "raise" `Infeasible`,
    "relax" them by the least that lets them agree, or "brake" to standstill. Raises
    `InvalidValue` if q0 does not fit the robot or lies outside its position limits, and if `duration` or
    `dt` is not positive, and what `Stack.compile` raises.
    """

    robot: Robot
    q0: ArrayLike
    stack: Stack
    duration: float
    dt: float = 1e-3
    on_conflict: ConflictPolicy = "raise"
    name: str = ""
    description: str = ""

    def __post_init__(self) -> None:
        positive("dt", self.dt)
        positive("duration", self.duration)
        checked_policy(self.on_conflict)
        if self.ticks == 0:
            raise InvalidValue(f"duration {self.duration:g} s is less than a step of {self.dt:g} s")
        object.__setattr__(self, "q0", self.robot.checked_q(self.q0))
        outside = self.robot.outside(self.start)
        if outside:
            raise InvalidValue(f"the start is outside the limits: {'; '.join(outside)}; move q0 inside")
        self.stack.compile(self.robot, self.dt)  # unknown names and wrong sizes are errors of the declaration

    @property
    def start(self) -> Array:
        """q0, (nq,), checked when the scenario was made."""
        return self.q0  # type: ignore[return-value]

    @property
    def ticks(self) -> int:
        """Number of steps."""
        return round(self.duration / self.dt)


def load_scenario(path: str | Path) -> Scenario:
    """The `scenario` of a Python file; its name is the file's, its description the docstring.

    The file is executed: load only what you trust. Raises `MissingFile`, `InvalidValue` if it is not
    Python or has no `scenario`, and lets through whatever the file itself raises.
    """
    file = _existing(Path(path))
    spec = spec_from_file_location(f"taskopt_scenario_{file.stem}", file)
    if spec is None or spec.loader is None:
        raise InvalidValue(f"{file} is not a Python file; a scenario ends in .py")
    module = module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses in the file look their module up
    try:
        spec.loader.exec_module(module)
    except SyntaxError as error:
        raise InvalidValue(f"{file} is not valid Python: line {error.lineno}: {error.msg}") from error
    scenario = getattr(module, "scenario", None)
    if not isinstance(scenario, Scenario):
        got = "has no name `scenario`" if scenario is None else f"has a `scenario` of {type(scenario)}"
        raise InvalidValue(f"{file} {got}; it must say scenario = Scenario(robot=…, q0=…, stack=…, …)")
    about = scenario.description or cleandoc(module.__doc__ or "")
    return replace(scenario, name=scenario.name or file.stem, description=about)


def scenario_files(folder: Path = SHELF) -> tuple[Path, ...]:
    """The scenario files of a folder, by name."""
    return tuple(sorted(file for file in folder.glob("*.py") if not file.name.startswith("_")))


def _existing(path: Path) -> Path:
    if path.is_file():
        return path
    shelf = path.parent if path.parent != Path() and path.parent.is_dir() else SHELF
    stems = {file.stem: str(file) for file in scenario_files(shelf)}
    near = [stems[stem] for stem in get_close_matches(path.stem, stems, n=3, cutoff=0.5)]
    there = f"there is {', '.join(stems.values())}" if stems else f"no scenario stands in {shelf}/"
    way_out = f"did you mean {', '.join(near)}?" if near else there
    raise MissingFile(f"no scenario file '{path}'; {way_out}")
