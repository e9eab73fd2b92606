"""The compilation of kernels: what makes compiled code stale, where it is kept, and what is said about it."""

import itertools
import os
import pty
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import FunctionType

import numba
import numpy as np
import pytest

import taskopt
from taskopt.errors import InvalidValue
from taskopt.jit import kernel
from taskopt.jit.borrowed import borrowed
from taskopt.jit.content import Reader
from taskopt.jit.progress import Report
from taskopt.jit.store import Store, users_folder

compiled_only = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="kernels are plain functions")

ROOT = Path(taskopt.__file__).parents[1]
PACKAGE = {
    "__init__.py": "",
    "constants.py": "SCALE = 2.0\nUNUSED = 1\n",
    "records.py": """
from enum import IntEnum
from typing import NamedTuple

class Side(IntEnum):
    LOWER = 1
    UPPER = 2

class Pair(NamedTuple):
    first: float
    second: float
""",
    "inner.py": '''
import numpy as np
from taskopt.jit import kernel, kernel_apart
from small import constants

SHIFTS, TABLE, WIDE = (1.0, 2.0), np.array([1.0, 3.0]), np.float64(0.5)

@kernel_apart
def inner(x):
    """Scale and shift."""
    return constants.SCALE * x + SHIFTS[1] + TABLE[0] + WIDE  # 2 x + 3.5
''',
    "foreign.py": """
import numba

@numba.njit
def foreign(x):
    return 1.0 * x
""",
    "middle.py": """
from taskopt.jit import kernel, kernel_apart
from small import inner
from small.foreign import foreign

@kernel
def middle(x, factor=1.0):
    return factor * foreign(inner.inner(x))
""",
    "outer.py": """
from taskopt.jit import kernel_apart
from small.middle import middle
from small.records import Pair, Side

def raised(power):
    @kernel_apart
    def raise_to(x):
        return x**power
    return raise_to

square = raised(2)

@kernel_apart
def outer(x):
    pair = Pair(middle(x), 1.0)
    return square(pair.first) - pair.second + Side.UPPER.value
""",
}
CALL = "from small.outer import outer; print(outer(0.25))"
ANSWER = (2.0 * 0.25 + 3.5) ** 2 - 1.0 + 2


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A folder with a package of three kernels that call each other."""
    write(tmp_path / "checkout")
    return tmp_path / "checkout"


def write(folder: Path) -> None:
    """Write the package into a folder."""
    (folder / "small").mkdir(parents=True)
    for name, text in PACKAGE.items():
        (folder / "small" / name).write_text(text)


def edit(folder: Path, file: str, old: str, new: str) -> None:
    """Replace a text that must be there."""
    path = folder / "small" / file
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


def environment(folder: Path, **variables: str) -> dict[str, str]:
    """Variables for a process that uses the package, with a folder of compiled kernels of its own."""
    kept = {key: value for key, value in os.environ.items() if not key.startswith("NUMBA_")}
    paths = {"PYTHONPATH": f"{folder}{os.pathsep}{ROOT}", "NUMBA_CACHE_DIR": str(folder.parent / "cache")}
    return kept | paths | {"PYTHONDONTWRITEBYTECODE": "1"} | variables


def run(folder: Path, code: str = CALL, **variables: str) -> tuple[float, str]:
    """Answer and stderr of a process of its own."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True, text=True, env=environment(folder, **variables), cwd=folder, check=True,
    )  # fmt: skip
    return float(done.stdout), done.stderr


def stamp(folder: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Stamp of the outermost kernel of the package as it stands on disk."""
    for name in [name for name in sys.modules if name.partition(".")[0] == "small"]:
        monkeypatch.delitem(sys.modules, name)
    with monkeypatch.context() as patch:
        patch.syspath_prepend(str(folder))
        patch.setattr(sys, "dont_write_bytecode", True)
        from small.outer import outer  # pyright: ignore[reportMissingImports]
    for name in [name for name in sys.modules if name.partition(".")[0] == "small"]:
        monkeypatch.delitem(sys.modules, name)
    return outer.stamp


CHANGES = {
    "a function that somebody else compiled": ("foreign.py", "1.0 * x", "1.5 * x"),
    "a constant of another module": ("constants.py", "SCALE = 2.0", "SCALE = 3.0"),
    "the type of a constant": ("constants.py", "SCALE = 2.0", "SCALE = 2"),
    "an entry of a tuple": ("inner.py", "(1.0, 2.0)", "(1.0, 2.5)"),
    "an entry of an array": ("inner.py", "[1.0, 3.0]", "[1.5, 3.0]"),
    "a scalar of NumPy": ("inner.py", "np.float64(0.5)", "np.float64(0.25)"),
    "a value of an enumeration": ("records.py", "UPPER = 2", "UPPER = 3"),
    "the order of fields": (
        "records.py", "    first: float\n    second: float", "    second: float\n    first: float",
    ),
    "code of a callee of a callee": ("inner.py", "* x + SHIFTS", "* x - SHIFTS"),
    "a number in the code": ("outer.py", "Pair(middle(x), 1.0)", "Pair(middle(x), 2.0)"),
    "a default of an argument": ("middle.py", "factor=1.0", "factor=2.0"),
    "a value in a closure": ("outer.py", "raised(2)", "raised(3)"),
    "how a kernel is called": ("middle.py", "@kernel\n", "@kernel_apart\n"),
}  # fmt: skip
EDITS = {
    "a comment": ("inner.py", "# 2 x + 3.5", "# another comment"),
    "a docstring": ("inner.py", "Scale and shift.", "Shift and scale."),
    "line numbers": ("inner.py", "import numpy", "\n\nimport numpy"),
    "a constant that is not read": ("constants.py", "UNUSED = 1", "UNUSED = 2"),
}


@compiled_only
@pytest.mark.parametrize("change", CHANGES)
def test_a_change_of_content_changes_the_stamp(
    change: str, small: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The stamp of a kernel changes with everything that it or one of its callees reads."""
    before = stamp(small, monkeypatch)
    edit(small, *CHANGES[change])
    assert stamp(small, monkeypatch) != before


@compiled_only
@pytest.mark.parametrize("edited", EDITS)
def test_an_edit_without_effect_keeps_the_stamp(
    edited: str, small: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Comments, docstrings, lines and constants of others do not belong to the content."""
    before = stamp(small, monkeypatch)
    edit(small, *EDITS[edited])
    assert stamp(small, monkeypatch) == before


@compiled_only
@pytest.mark.parametrize("change", ["a constant of another module", "a value of an enumeration"])
def test_planted_fault_constants_ignored(change: str, small: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader that overlooks constants is caught by `test_a_change_of_content_changes_the_stamp`."""
    value = Reader._value

    def blind(self: Reader, what: object, *rest: object) -> str:
        is_constant = isinstance(what, float | type)
        return "" if is_constant else value(self, what, *rest)  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr(Reader, "_value", blind)
    before = stamp(small, monkeypatch)
    edit(small, *CHANGES[change])
    assert stamp(small, monkeypatch) == before


def test_an_unknown_value_is_refused() -> None:
    """A value whose change could not be noticed is an error that names the kernel."""
    scope: dict[str, object] = {"thing": Store(None)}
    exec("def reads():\n    return thing", scope)
    function = scope["reads"]
    assert isinstance(function, FunctionType)
    with pytest.raises(InvalidValue, match=r"reads cannot be compiled.*Store"):
        Reader(lambda value: False).read(function)


@pytest.mark.slow
def test_a_changed_constant_reaches_compiled_code(small: Path) -> None:
    """A second process with another constant computes with that constant, and a third with the first."""
    assert run(small)[0] == ANSWER
    edit(small, "constants.py", "SCALE = 2.0", "SCALE = 4.0")
    assert run(small)[0] == (4.0 * 0.25 + 3.5) ** 2 + 1.0
    edit(small, "constants.py", "SCALE = 4.0", "SCALE = 2.0")
    answer, said = run(small)
    assert answer == ANSWER
    assert said == ""  # it was still there


def parts(folder: Path) -> dict[str, list[Path]]:
    """Files of compiled code by kernel."""
    found: dict[str, list[Path]] = {}
    for path in sorted((folder.parent / "cache" / "taskopt" / "kernels").iterdir()):
        found.setdefault(path.name.split("-")[0].rpartition(".")[2], []).append(path)
    return found


def check_after_loss(folder: Path, *lost: str) -> None:
    """Delete the machine code of some kernels; the next process answers as before."""
    for name in lost:
        for path in parts(folder)[name]:
            path.unlink()
    answer, said = run(folder)
    assert answer == ANSWER, lost
    assert ("compiling" in said) == (lost != ("middle",)), lost  # its machine code is part of outer's


@compiled_only
@pytest.mark.slow
def test_callee_and_caller_fit_when_one_is_compiled_again(small: Path) -> None:
    """Machine code that calls by name finds its callee, whichever of the two is compiled again."""
    assert run(small)[0] == ANSWER
    check_after_loss(small, "inner")
    check_after_loss(small, "outer")
    assert run(small) == (ANSWER, "")


@compiled_only
@pytest.mark.slow
def test_callee_and_caller_fit_in_whatever_order_they_were_compiled(small: Path) -> None:
    """The same for all subsets of the kernels, and for a process that calls the callee first."""
    assert run(small)[0] == ANSWER
    names = ("inner", "middle", "outer", "raise_to")
    for size in range(1, 5):
        for lost in itertools.combinations(names, size):
            check_after_loss(small, *lost)
    assert run(small, "from small.inner import inner; inner(1.0); inner(1); " + CALL)[0] == ANSWER
    assert run(small) == (ANSWER, "")


@compiled_only
@pytest.mark.slow
def test_planted_fault_callee_not_loaded(small: Path) -> None:
    """A process that does not load the callee first dies, which the tests above would notice."""
    fault = "from taskopt.jit import Kernel; Kernel.called_by_name = lambda self: (); "
    assert run(small, fault + CALL)[0] == ANSWER  # it compiled the callee itself
    with pytest.raises(subprocess.CalledProcessError):
        run(small)


@compiled_only
@pytest.mark.slow
def test_another_checkout_of_the_same_content_compiles_nothing(small: Path) -> None:
    """The folder of compiled kernels is shared, since files are named by content and not by place."""
    assert run(small)[1] != ""
    other = small.parent / "other"
    shutil.copytree(small, other)
    assert run(other) == (ANSWER, "")


@compiled_only
@pytest.mark.slow
def test_planted_fault_place_in_the_stamp(small: Path) -> None:
    """If the file belonged to the content, the test above would fail."""
    fault = (
        "from taskopt.jit import content; code = content._code; "
        "content._code = lambda c, *d: code(c, *d) + c.co_filename; "
    )
    assert run(small, fault + CALL)[1] != ""
    other = small.parent / "other"
    shutil.copytree(small, other)
    assert run(other, fault + CALL)[1] != ""


@compiled_only
@pytest.mark.slow
def test_processes_that_compile_at_once_do_not_disturb_each_other(small: Path) -> None:
    """All of them answer, leave no unfinished file, and a later one compiles nothing."""
    command = [sys.executable, "-c", CALL]
    started = [
        subprocess.Popen(command, stdout=subprocess.PIPE, env=environment(small), cwd=small, text=True)
        for _ in range(3)
    ]
    assert [float(process.communicate()[0]) for process in started] == [ANSWER] * 3
    assert not [name for name in parts(small) if name.startswith(".writing")]
    assert run(small) == (ANSWER, "")


def test_a_full_disk_leaves_no_half_written_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a file cannot be completed, nothing stays in the folder, and the caller goes on."""
    store = Store(tmp_path)

    def full(*_: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("taskopt.jit.store.zlib.crc32", full)
    store.write("kernel", b"code")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_no_place_to_write_costs_one_line(small: Path) -> None:
    """Without a folder that can be written everything works, and one line names the way out."""
    (small.parent / "file").write_text("")
    variables = {"NUMBA_CACHE_DIR": "", "XDG_CACHE_HOME": "", "HOME": str(small.parent / "file" / "home")}
    answer, said = run(small, **variables)
    assert answer == ANSWER
    if not numba.config.DISABLE_JIT:
        lines = [line for line in said.splitlines() if "NUMBA_CACHE_DIR" in line]
        assert len(lines) == 1
        assert "cannot be written" in lines[0]


@pytest.mark.slow
def test_disabled_compilation_leaves_plain_functions(small: Path) -> None:
    """With NUMBA_DISABLE_JIT=1 a kernel is the function itself, and the answer is the same."""
    plain = "import types; from small.outer import outer; assert type(outer) is types.FunctionType; "
    assert run(small, plain + CALL, NUMBA_DISABLE_JIT="1") == (ANSWER, "")


@pytest.mark.slow
@compiled_only
def test_planted_fault_compiled_although_disabled(small: Path) -> None:
    """The check of the test above fails for a compiled kernel."""
    plain = "import types; from small.outer import outer; assert type(outer) is types.FunctionType; "
    with pytest.raises(subprocess.CalledProcessError):
        run(small, plain + CALL)


@compiled_only
@pytest.mark.slow
def test_a_bar_on_a_terminal_names_the_kernel(small: Path) -> None:
    """On a terminal a bar says which kernel is being compiled and how many there are."""
    terminal, end = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", CALL], stdout=subprocess.DEVNULL, stderr=end, cwd=small,
        env=environment(small, TERM="xterm", COLUMNS="120"),
    )  # fmt: skip
    os.close(end)
    shown = b""
    while chunk := _read(terminal):
        shown += chunk
    assert process.wait() == 0
    assert b"/4" in shown
    assert b"raise_to" in shown or b"inner" in shown


def _read(terminal: int) -> bytes:
    """Return what a terminal shows next; nothing once the process has ended."""
    try:
        return os.read(terminal, 65536)
    except OSError:
        return b""


def test_a_damaged_file_counts_as_missing(tmp_path: Path) -> None:
    """A file that was cut short is compiled again instead of being loaded."""
    store = Store(tmp_path)
    store.write("whole", b"machine code")
    assert store.read("whole") == b"machine code"
    (tmp_path / "whole").write_bytes((tmp_path / "whole").read_bytes()[:-1])
    assert store.read("whole") is None
    assert store.read("absent") is None


def test_unused_files_are_deleted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files unused for 30 days go, then those unused for longest beyond the limit of size.

    A file that a process was killed while writing goes after an hour; one that is being written stays.
    """
    store = Store(tmp_path)
    for name, hours in {".writing-now": 0.5, ".writing-killed": 1.5}.items():
        (tmp_path / name).write_bytes(b"")
        os.utime(tmp_path / name, (time.time() - hours * 3600.0,) * 2)
    store.clean()
    assert store.names() == {".writing-now"}
    (tmp_path / ".writing-now").unlink()
    for name, days in {"new": 0.0, "week": 7.0, "fortnight": 14.0, "old": 31.0}.items():
        store.write(name, bytes(96))
        os.utime(tmp_path / name, (time.time() - days * 86400.0,) * 2)
    store.clean()
    assert store.names() == {"new", "week", "fortnight"}
    monkeypatch.setattr("taskopt.jit.store.KEPT_BYTES", 250.0)
    store.clean()
    assert store.names() == {"new", "week"}
    assert store.read("week") is not None  # a use makes it new again
    assert time.time() - (tmp_path / "week").stat().st_mtime < 60.0


@pytest.mark.parametrize(
    ("variables", "configured", "expected"),
    [
        ({"HOME": "/users/x"}, "", "/users/x/.cache/taskopt/kernels"),
        ({"HOME": "/users/x", "XDG_CACHE_HOME": "/c"}, "", "/c/taskopt/kernels"),
        ({"HOME": "/users/x", "XDG_CACHE_HOME": "/c"}, "/n", "/n/taskopt/kernels"),
    ],
)
def test_place_of_compiled_kernels(
    variables: dict[str, str], configured: str, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """NUMBA_CACHE_DIR goes before XDG_CACHE_HOME, and that before the home."""
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert users_folder(configured) == Path(expected)


def test_lines_around_a_compilation(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Away from a terminal there is one line before, one after a long compilation, and no more."""
    report = Report()
    report.begin(3, "/cache", kept=True)
    report.compiling("first")
    report.compiled()
    report.end()
    report.begin(1, "/cache", kept=True)
    monkeypatch.setattr("taskopt.jit.progress._SHORT", -1.0)
    report.end()
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert "compiling" in lines[0]
    assert "compiled in" in lines[1]
    assert not report.running


def test_kernels_are_copied_by_name() -> None:
    """A deep copy of a kernel is the kernel, as it is for a function."""
    import copy
    import pickle

    from taskopt.kinematics.lie import log3_into

    assert copy.deepcopy(log3_into) is log3_into
    assert pickle.loads(pickle.dumps(log3_into)) is log3_into


@compiled_only
def test_a_kernel_keeps_name_and_docstring() -> None:
    """`help()` of a kernel shows the function."""

    def documented(x: float) -> float:
        """Return x."""
        return x

    compiled: Callable[[float], float] = kernel(documented)
    assert compiled.__doc__ == "Return x."
    assert compiled(2.0) == 2.0


@kernel
def _write_through_views(matrix: np.ndarray) -> float:
    """Write into a view of a borrowed array, and read the array."""
    rows = borrowed(matrix)
    rows[1][1:].reshape(1, -1)[0, 1] = 7.0
    return float(rows.sum())


def test_a_borrowed_array_is_the_same_memory_and_outlives_its_views():
    """Views of it count no references, so a count that went wrong would free memory that Python holds."""
    matrix = np.zeros((2, 3))
    before = sys.getrefcount(matrix)
    for _ in range(1000):
        assert _write_through_views(matrix) == 7.0
    assert sys.getrefcount(matrix) == before
    np.testing.assert_array_equal(matrix, [[0, 0, 0], [0, 0, 7]])
