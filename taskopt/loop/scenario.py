"""Scenarios, which have the robot, start, stack, duration and period of a run, and loading their files."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from importlib.util import module_from_spec, spec_from_file_location
from inspect import cleandoc
from pathlib import Path
from traceback import extract_tb

from taskopt.arrays import Array, ArrayLike, positive
from taskopt.errors import InvalidValue, MissingFile, TaskoptError
from taskopt.kinematics.binding import require_robot
from taskopt.kinematics.parameter import Setting
from taskopt.kinematics.robot import Robot
from taskopt.kinematics.stack import Plan, Stack
from taskopt.resolver.infeasible import ConflictPolicy, checked_policy

FOLDER = Path("tasks")
DEMO = Path(__file__).parents[1] / "demo.py"  # the scenario that is part of the package


@dataclass(frozen=True, eq=False, kw_only=True)
class Scenario:
    """Everything that a run needs besides the resolver.

    Attributes:
        robot: The robot.
        q0: Start posture, (nq,) [rad, m]; the name of a posture; or a mapping from joint to number. It must
            be inside the robot's position limits.
        stack: The tasks and limits.
        duration: Length of the run [s].
        dt: Period, the time between two ticks [s].
        on_conflict: What to do at a tick whose hard limits contradict each other: "raise" `Infeasible`,
            "relax" them by the least that lets them agree, or "brake" to standstill.
        settings: Parameters that the run begins with instead of what the stack declares, by address, such as
            {"hand.weight": 0.1}; see `Controller.set`.
        trails: Frames, such as that of an elbow, whose paths a recording shows in addition to those of the
            tasks.
        name: Name of the run and of its log folder; a scenario file gives its own name.
        description: A few sentences for the viewer; a scenario file gives its docstring.

    Raises:
        InvalidValue: q0 does not fit the robot or lies outside its position limits, `duration` or `dt` is not
            positive, or the duration is less than one period; or `Stack.compile` raises it.
        UnknownName: There is no frame, joint or policy of a given name.
    """

    robot: Robot
    q0: ArrayLike | Mapping[str, float]
    stack: Stack
    duration: float
    dt: float = 1e-3
    on_conflict: ConflictPolicy = "raise"
    settings: Mapping[str, Setting] = field(default_factory=dict)
    trails: Sequence[str] = ()
    name: str = ""
    description: str = ""

    def __post_init__(self) -> None:
        require_robot(self.robot)
        positive("dt", self.dt)
        positive("duration", self.duration)
        checked_policy(self.on_conflict)
        if self.ticks == 0:
            raise InvalidValue(f"duration {self.duration:g} s is less than a step of {self.dt:g} s")
        object.__setattr__(self, "q0", self.robot.checked_q(self.q0))
        outside = self.robot.outside(self.start)
        if outside:
            raise InvalidValue(f"the start is outside the limits: {'; '.join(outside)}; move q0 inside")
        if isinstance(self.trails, str):
            raise InvalidValue(f"trails must be a list of frames; write [{self.trails!r}]")
        for frame in self.trails:
            self.robot.frame_id(frame)
        self.compile()  # unknown names and wrong sizes are errors of the declaration

    def compile(self) -> Plan:
        """Compile the stack for the robot, with the settings of the scenario.

        Returns:
            The plan; its first tick applies the settings.

        Raises:
            UnknownName: There is no frame, joint or parameter of a name that is used.
            InvalidValue: As `Stack.compile`, or a parameter does not take its value.
        """
        plan = self.stack.compile(self.robot, self.dt)
        if self.settings:
            plan.set(self.settings)
        return plan

    @property
    def start(self) -> Array:
        """Start posture q0, (nq,) [rad, m], checked when the scenario was made."""
        return self.q0  # type: ignore[return-value]

    @property
    def ticks(self) -> int:
        """Number of ticks, the duration divided by the period and rounded."""
        return round(self.duration / self.dt)


def load_scenario(path: str | Path) -> Scenario:
    """Load the scenario of a Python file, which is the variable `scenario` of that file.

    The file is executed, so load only files that you trust.

    Args:
        path: The file; or "demo" for the scenario that is part of the package.

    Returns:
        The scenario. If it lacks a name or a description, it gets the file's name or docstring.

    Raises:
        MissingFile: There is no such file; the message suggests near names.
        InvalidValue: The file is not Python, has no `scenario`, or does something wrong; the message has the
            line.
        TaskoptError: An error of this package, raised by the file; a note has the line.
    """
    file = DEMO if str(path) == DEMO.stem and not Path(path).exists() else _existing(Path(path))
    spec = spec_from_file_location(f"taskopt_scenario_{file.stem}", file)
    if spec is None or spec.loader is None:
        raise InvalidValue(f"{file} is not a Python file; a scenario ends in .py")
    module = module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses in the file look their module up
    try:
        spec.loader.exec_module(module)
    except SyntaxError as error:
        raise InvalidValue(f"{file} is not valid Python: line {error.lineno}: {error.msg}") from error
    except TaskoptError as error:
        error.add_note(_place(error, file))
        raise
    except Exception as error:  # whatever else a user's file does wrong is told with its line
        raise InvalidValue(f"{_place(error, file)}: {type(error).__name__}: {error}") from error
    scenario = getattr(module, "scenario", None)
    if not isinstance(scenario, Scenario):
        got = (
            "has no name `scenario`"
            if scenario is None
            else f"has a `scenario` of type {type(scenario).__name__}"
        )
        raise InvalidValue(f"{file} {got}; it must contain scenario = Scenario(robot=…, q0=…, stack=…, …)")
    about = scenario.description or cleandoc(module.__doc__ or "")
    return replace(scenario, name=scenario.name or file.stem, description=about)


def scenario_files(folder: Path = FOLDER) -> tuple[Path, ...]:
    """List the scenario files of a folder.

    Args:
        folder: The folder; by default `tasks` in the working directory.

    Returns:
        The Python files whose names do not begin with an underscore, in alphabetical order.
    """
    return tuple(sorted(file for file in folder.glob("*.py") if not file.name.startswith("_")))


def _place(error: Exception, file: Path) -> str:
    """Return the file and its last line that took part in an error."""
    frames = extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if Path(frame.filename).resolve() == file.resolve()]
    return f"{file}, line {lines[-1]}" if lines else str(file)


def _existing(path: Path) -> Path:
    """Return the path of a file that exists; else raise `MissingFile` with the nearest names."""
    if path.is_file():
        return path
    folder = path.parent if path.parent != Path() and path.parent.is_dir() else FOLDER
    stems = {file.stem: str(file) for file in scenario_files(folder)}
    near = [stems[stem] for stem in get_close_matches(path.stem, stems, n=3, cutoff=0.5)]
    demo = "`taskopt run demo` runs one that is in the package"
    there = (
        f"there is {', '.join(stems.values())}" if stems else f"there are no scenarios in {folder}/; {demo}"
    )
    way_out = f"did you mean {', '.join(near)}?" if near else there
    raise MissingFile(f"no scenario file '{path}'; {way_out}")
