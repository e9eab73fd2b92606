"""Everything that a user needs is in `taskopt`, and a name that is not there is answered with advice."""

import ast
import pydoc
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import taskopt

ROOT = Path(__file__).parents[1]
FACE = Path(taskopt.__file__)  # the tests also run away from the checkout


def test_checkers_and_python_see_the_same_names() -> None:
    """The stub for type checkers, `__all__` and `dir` agree, and every name is found where they say."""
    stub = ast.parse(FACE.with_suffix(".pyi").read_text("utf-8"))
    told = {
        alias.name: node.module
        for node in stub.body
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
        if alias.name == alias.asname
    }
    assert sorted(told) == dir(taskopt) == sorted(taskopt.__all__)
    for name, module in told.items():
        assert getattr(taskopt, name) is getattr(import_module(module), name)


def test_a_star_import_brings_every_name() -> None:
    """`from taskopt import *` defines all of `__all__`, and nothing else."""
    scope: dict[str, object] = {}
    exec("from taskopt import *", scope)
    assert set(scope) - {"__builtins__"} == set(taskopt.__all__)


@pytest.mark.parametrize(
    ("name", "advice"),
    [
        ("CentreOfMass", "did you mean CentreOfMassTask?"),
        ("FrameTaks", "did you mean FrameTask?"),
        ("log6", "it lives in taskopt.kinematics.pose"),
        ("xyzzy", "dir(taskopt) lists"),
    ],
)
def test_an_unknown_name_is_answered_with_advice(name: str, advice: str) -> None:
    """The near name or the module that defines it is in the message, for attributes and for imports."""
    with pytest.raises(AttributeError) as asked:
        getattr(taskopt, name)
    with pytest.raises(ImportError) as imported:
        exec(f"from taskopt import {name}")
    assert advice in str(asked.value)
    assert advice in str(imported.value)
    assert not hasattr(taskopt, name)


def test_modules_are_imported_as_usual() -> None:
    """`from taskopt import errors` is the module, though `taskopt` has no public name `errors`."""
    scope: dict[str, object] = {}
    exec("from taskopt import errors", scope)
    assert scope["errors"] is import_module("taskopt.errors")


@pytest.mark.parametrize("kind", ["AttributeError", "ImportError", "ZeroDivisionError"])
def test_an_error_inside_a_module_is_not_hidden(kind: str, tmp_path: Path) -> None:
    """Where the module of a name cannot be imported, its own error is shown, not "cannot import name"."""
    package = tmp_path / "taskopt"
    (package / "loop").mkdir(parents=True)
    for file in ("__init__.py", "synonyms.py"):
        (package / file).write_text(FACE.with_name(file).read_text("utf-8"), "utf-8")
    (package / "loop" / "scenario.py").write_text(f"raise {kind}('inner')\n", "utf-8")
    done = subprocess.run(
        [sys.executable, "-c", "from taskopt import Scenario"],
        cwd=tmp_path,
        env={"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert "loop/scenario.py" in done.stderr
    assert f"{kind}: inner" in done.stderr
    assert "cannot import name" not in done.stderr


@pytest.mark.parametrize("file", sorted((ROOT / "tasks").glob("*.py")), ids=lambda file: file.stem)
def test_scenarios_need_no_deeper_import(file: Path) -> None:
    """Shipped scenarios import names from `taskopt` alone."""
    assert re.findall(r"^from taskopt\.\S+ import .*", file.read_text("utf-8"), flags=re.MULTILINE) == []


@pytest.mark.slow
def test_help_is_short() -> None:
    """`help()` prints the names of array types, not the type parameters of NumPy."""
    pages = {name: pydoc.render_doc(getattr(taskopt, name)) for name in dir(taskopt)}
    assert "Array" in pages["Configuration"]
    assert [name for name, page in pages.items() if "numpy.dtype[" in page or "_SupportsArray" in page] == []
