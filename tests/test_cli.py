"""The command line: what a user types, what comes back, and what every mistake is answered with."""

import cmath
import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import sleep

import pytest

from taskopt import cli
from taskopt.cli import main
from taskopt.errors import MissingFile

ROOT = Path(__file__).parents[1]
PLANAR, PANDA = str(ROOT / "tasks" / "planar_circle.py"), str(ROOT / "tasks" / "panda_circle.py")
ARM = """
from taskopt import FrameTask, JointTask, Scenario, Stack
from taskopt.kinematics.robot import planar_arm
arm = planar_arm([0.5, 0.5], -1.0, 1.0)
"""
SCENARIO = "scenario = Scenario(robot=arm, q0=[0.1, 0.2], stack=Stack([[JointTask()]]), duration=0.01)\n"
MESHLESS = """
from pathlib import Path
from time import sleep
from taskopt import Robot
mesh = "<visual><geometry><mesh filename='nowhere.stl'/></geometry></visual>"
Path("a.urdf").write_text(f"<robot name='a'><link name='b'>{mesh}</link></robot>")
print(Robot.from_urdf("a.urdf", floating=True).visual)
"""


@dataclass(frozen=True)
class Done:
    """What a command left behind."""

    code: int
    stdout: str
    stderr: str

    @property
    def refusal(self) -> str:
        """The one line on stderr of a command that ended with exit code 2."""
        lines = [line for line in self.stderr.splitlines() if not line.startswith("compiling")]
        assert self.code == 2, self.stderr
        assert len(lines) == 1, self.stderr
        assert lines[0].startswith("taskopt: ")
        return lines[0]


Command = Callable[..., Done]


@pytest.fixture
def taskopt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    """Types a command line in an empty folder without a display."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    for display in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(display, raising=False)

    def typed(*words: str) -> Done:
        monkeypatch.setattr("sys.argv", ["taskopt", *words])
        with pytest.raises(SystemExit) as end:
            main()
        return Done(int(end.value.code or 0), *capsys.readouterr())

    return typed


@pytest.mark.slow
def test_run_ends_in_a_summary_and_a_recording(tmp_path: Path, taskopt: Command) -> None:
    """One line of figures, and a folder with recording, table and manifest of a finished run."""
    done = taskopt("run", PLANAR, "--duration", "0.1")
    assert done.code == 0, done.stderr
    assert "planar_circle: 100 ticks of 1 ms" in done.stdout
    assert "active-set" in done.stdout
    (log,) = (tmp_path / "logs" / "planar_circle").iterdir()
    assert {"run.rrd", "steps.arrows", "manifest.json"} <= {file.name for file in log.iterdir()}
    assert json.loads((log / "manifest.json").read_text())["status"] == "finished"


@pytest.mark.slow
def test_compare_puts_all_in_one_table_and_one_recording(tmp_path: Path, taskopt: Command) -> None:
    """Every resolver has a row; there is one log."""
    names = ["pinv", "wqp/proxqp", "hqp/daqp", "active-set"]
    words = [word for name in names for word in ("-r", name)]
    done = taskopt("compare", PANDA, *words, "--duration", "0.05")
    assert done.code == 0, done.stderr
    assert all(f" {name} " in done.stdout for name in names)
    (log,) = (tmp_path / "logs" / "panda_circle").iterdir()
    assert json.loads((log / "manifest.json").read_text())["resolvers"] == names


def test_nothing_is_written_where_nothing_is_asked_for(tmp_path: Path, taskopt: Command) -> None:
    """--no-record leaves the folder as it was."""
    done = taskopt("run", PLANAR, "--duration", "0.01", "--no-record")
    assert done.code == 0, done.stderr
    assert not list(tmp_path.iterdir())


def test_list_names_what_there_is(tmp_path: Path, taskopt: Command) -> None:
    """Robots, solvers and resolvers are listed; scenarios are those of tasks/ in the folder."""
    (tmp_path / "tasks").mkdir()
    (tmp_path / "tasks" / "mine.py").touch()
    done = taskopt("list")
    assert done.code == 0, done.stderr
    assert all(
        word in done.stdout for word in ["panda", "proxqp", "active-set", "dls/chiaverini", "tasks/mine.py"]
    )


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["run"],
        ["compare"],
        ["view"],
        ["figures"],
        ["warmup"],
        ["list"],
        ["bench"],
        ["bench", "accuracy"],
        ["bench", "fuzz"],
        ["bench", "strictness"],
        ["bench", "run"],
        ["bench", "report"],
        ["bench", "diff"],
        ["bench", "sets"],
        ["bench", "capture"],
        ["bench", "export"],
        ["bench", "proof"],
        ["show"],
        ["replay"],
        ["export"],
        ["diff"],
        ["report"],
        ["sweep"],
    ],
)
def test_help_says_what_there_is(words: list[str], taskopt: Command) -> None:
    """--help answers for every command, and no sentence of it is cut off."""
    done = taskopt(*words, "--help")
    assert done.code == 0
    assert "Usage:" in done.stdout
    assert "..." not in re.sub(r"(COMMAND \[ARGS\]|NUMBER\]+|FILES\]+)\.\.\.", "", done.stdout)


@pytest.mark.slow
def test_the_accuracy_benchmark_prints_a_table_with_and_without_bounds_that_bind(taskopt: Command) -> None:
    """Only the solvers asked for, at most 120 columns, the largest unflagged error in words."""
    done = taskopt("bench", "accuracy", "-s", "daqp", "--trials", "1")
    assert done.code == 0, done.stderr
    assert all(words in done.stdout for words in ["no bound active", "bounds active", "daqp"])
    assert done.stdout.count("Largest error of an answer that is proven") == 2
    assert "clarabel" not in done.stdout
    assert max(map(len, done.stdout.splitlines())) <= 120
    assert "no resolver named 'hqp/dapq'" in taskopt("bench", "accuracy", "-s", "dapq").refusal


@pytest.mark.slow
def test_a_comparison_from_a_scenario_to_a_report(tmp_path: Path, taskopt: Command) -> None:
    """Capture a set, compare on it, write the report; a second run has nothing to do, and nothing differs."""
    done = taskopt("bench", "capture", PLANAR, "-o", "mine.npz", "--ticks", "3")
    assert "wrote mine.npz: 3 problems" in done.stdout, done.stderr
    words = ["bench", "run", "--set", "mine.npz", "-r", "active-set,pinv,hqp/daqp", "--out", "out"]
    assert taskopt(*words).code == 0
    rows = (tmp_path / "out" / "rows.jsonl").read_text()
    assert taskopt(*words).code == 0
    assert (tmp_path / "out" / "rows.jsonl").read_text().startswith(rows)
    done = taskopt("bench", "report", "out")
    assert "`pinv` has the exact optimum in all problems of: mine.npz" in done.stdout
    assert (tmp_path / "out" / "report" / "benchmark.html").is_file()
    done = taskopt("bench", "diff", "out", "out")
    assert "→ " in done.stdout
    assert "1.000" in done.stdout


@pytest.mark.slow
def test_warmup_compiles_everything_and_says_so(taskopt: Command) -> None:
    """It ends well, also where everything is compiled already."""
    done = taskopt("warmup")
    assert done.code == 0, done.stderr
    assert "everything is compiled" in done.stdout


def test_help_does_not_wait_for_the_libraries() -> None:
    """Neither Pinocchio nor Numba nor NumPy is imported for it."""
    code = "import sys, taskopt.cli; print(*({'pinocchio', 'numba', 'numpy'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["run", PLANAR, "-r", "hqp/dapq"], ["no resolver named 'hqp/dapq'", "hqp/daqp"]),
        (["run", PLANAR, "-r", "activ-set"], ["did you mean active-set"]),
        (["run", "planar_circle.py"], ["no scenario file 'planar_circle.py'"]),
        (["run", PLANAR, "--duration", "-1"], ["duration must be > 0", "-1"]),
        (["run", PLANAR, "--live", "--no-record"], ["--live", "--no-record"]),
        (["compare", PLANAR, "-r", "pinv", "-r", "pinv"], ["twice", "pinv"]),
        (["view"], ["logs", "taskopt run"]),
        (["view", "nowhere"], ["nowhere"]),
    ],
)
def test_a_mistake_on_the_line_gets_one_line_back(
    words: list[str], expected: list[str], taskopt: Command
) -> None:
    """What, got, and the way out, with exit code 2."""
    line = taskopt(*words).refusal
    assert all(word in line for word in expected), line


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (ARM, ["has no name `scenario`", "scenario = Scenario("]),
        (ARM + SCENARIO.replace("0.2]", "1.2]"), ["joint2 at 1.2 rad", "allowed -1 to 1", "move q0 inside"]),
        (ARM + SCENARIO.replace("0.1, 0.2", "0.1"), ["shape 2", "got 1"]),
        (ARM + SCENARIO.replace("0.2]", "float('nan')]"), ["NaN at index 1"]),
        (ARM + SCENARIO.replace("0.01)", "0.01, dt=0.0)"), ["dt must be > 0", "got 0"]),
        (
            ARM + SCENARIO.replace("JointTask()", "FrameTask('tipp')"),
            ["no frame named 'tipp'", "did you mean tip"],
        ),
        (
            ARM + SCENARIO.replace("JointTask()", "JointTask(joints=['joint3'])"),
            ["no joint named 'joint3'", "joint1"],
        ),
        (
            "from taskopt import Robot\nRobot.load('pandas')\n",
            ["no robot named 'pandas'", "did you mean panda"],
        ),
        ("from taskopt import Robot\nRobot.from_urdf('missing.urdf')\n", ["missing.urdf"]),
        (MESHLESS, ["nowhere.stl"]),
    ],
)
def test_a_mistake_in_a_scenario_gets_one_line_back(
    text: str, expected: list[str], tmp_path: Path, taskopt: Command
) -> None:
    """Names are answered with the nearest ones, values with what is allowed."""
    (tmp_path / "mine.py").write_text(text, encoding="utf-8")
    line = taskopt("run", "mine.py").refusal
    assert all(word in line for word in expected), line


def test_a_folder_that_cannot_be_written_gets_one_line_back(tmp_path: Path, taskopt: Command) -> None:
    """A file stands where the log folder should be."""
    (tmp_path / "logs").touch()
    assert "logs" in taskopt("run", PLANAR, "--duration", "0.01").refusal


def test_without_a_display_view_says_what_to_do(tmp_path: Path, taskopt: Command) -> None:
    """A picture is offered, and the command for another machine."""
    assert taskopt("run", PLANAR, "--duration", "0.01").code == 0
    line = taskopt("view").refusal
    assert "--picture" in line
    assert "run.rrd" in line


def test_debug_shows_the_traceback(taskopt: Command) -> None:
    """The same mistake with --debug, before or after the command, is raised as it is."""
    for words in (["--debug", "run", "nowhere.py"], ["run", "nowhere.py", "--debug"]):
        with pytest.raises(MissingFile):
            taskopt(*words)


@pytest.mark.slow
def test_the_program_itself_answers_a_mistake_with_one_line(tmp_path: Path) -> None:
    """Run as a user runs it: one line on stderr, exit code 2, no traceback."""
    command = [sys.executable, "-c", "from taskopt.cli import main; main()", "run", "nowhere.py"]
    done = subprocess.run(
        command, cwd=tmp_path, env={"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False
    )
    assert Done(done.returncode, done.stdout, done.stderr).refusal.startswith("taskopt: no scenario file")


@pytest.mark.slow
def test_a_run_that_is_broken_off_keeps_what_it_has(tmp_path: Path) -> None:
    """Ctrl-C ends in the summary so far, exit code 130, and a log that says interrupted."""
    listen = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    command = [sys.executable, "-c", f"{listen}; from taskopt.cli import main; main()", "run", PLANAR]
    going = subprocess.Popen(
        [*command, "--duration", "600"],
        cwd=tmp_path,
        env={"PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    for _ in range(600):
        if any(file.stat().st_size for file in tmp_path.glob("logs/*/*/steps.arrows")):
            break
        sleep(0.1)
    going.send_signal(signal.SIGINT)
    stdout, stderr = going.communicate(timeout=60.0)
    assert going.returncode == 130, stderr
    assert "active-set" in stdout
    (manifest,) = tmp_path.glob("logs/*/*/manifest.json")
    assert json.loads(manifest.read_text())["status"] == "interrupted"


@pytest.mark.slow
def test_warmup_without_compilation_says_so() -> None:
    """NUMBA_DISABLE_JIT=1 leaves nothing to compile."""
    done = subprocess.run(
        [sys.executable, "-c", "from taskopt.cli import app; app(['warmup'])"],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(Path(cli.__file__).parents[1])},
        capture_output=True,
        text=True,
        check=True,
    )
    assert "nothing is compiled, and everything runs as plain Python" in done.stdout


def test_a_posture_for_a_position_is_printed(taskopt: Command) -> None:
    """The joints come first, and the tip of two links of 0.5 m is where it was asked to be."""
    done = taskopt("pose", "planar2", "--frame", "tip", "--at", "0.6,0.3,0")
    assert done.code == 0
    joints, verdict = done.stdout.splitlines()
    first, second = (float(word) for word in joints.split())
    tip = 0.5 * (cmath.exp(1j * first) + cmath.exp(1j * (first + second)))
    assert abs(tip - (0.6 + 0.3j)) < 2e-6
    assert verdict.startswith("SOLVED")


def test_a_posture_that_is_none_has_its_reason(taskopt: Command) -> None:
    """A position out of reach ends with 1, and with the least error."""
    done = taskopt("pose", "planar2", "--frame", "tip", "--at", "1.5,0,0")
    assert done.code == 1
    assert "UNREACHABLE" in done.stdout
    assert "0.5 m" in done.stdout


@pytest.mark.parametrize(
    ("at", "says"), [("0.6,x,0", "numbers separated by commas"), ("0.6,0.3", "goal of 'tip'")]
)
def test_positions_that_are_none_are_refused(taskopt: Command, at: str, says: str) -> None:
    """What cannot be read is said in one line."""
    assert says in taskopt("pose", "planar2", "--frame", "tip", "--at", at).refusal
