"""All tolerances stand in one table, and each says what it decides."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import taskopt
from taskopt.hierarchy import tolerances

PACKAGE = Path(taskopt.__file__).parent
TABLE = Path(tolerances.__file__)
SMALL = 1e-3  # a smaller literal is a tolerance, a step, or a floor, and none of them is obvious
ALLOWED = {
    "bench/accuracy.py": "singular values and steps that the benchmark plants",
    "bench/comparison/plots.py": "the least distance that a logarithmic axis shows",
    "bench/comparison/results.py": "the shift of a mean of times",
    "bench/comparison/trial.py": "nanoseconds in seconds",
    "bench/random_stacks.py": "distances to a limit that the benchmark plants",
    "bench/strictness.py": "weights that are compared, and the accuracy that an oracle is asked for",
    "figures/algorithms.py": "the least error that a logarithmic axis shows",
    "figures/singularities.py": "a joint that is nearly fixed, for a slice through a workspace",
    "kinematics/collision/always_near.py": "the radius of a ball that stands for a point",
    "kinematics/geometry/coal.py": "a thickness",
    "kinematics/lockstep/functions.py": "coefficients of polynomials, and the digits of π/2",
    "kinematics/objective/function.py": "the step of a difference",
    "kinematics/target.py": "the step of a difference",
    "log/claims.py": "nanoseconds in seconds",
    "loop/loop.py": "nanoseconds in seconds",
    "recording/viewer/picture.py": "nanoseconds in seconds",
    "report.py": "the shift of a mean of times",
    "resolver/cvxpy_model.py": "a guard against division by zero",
    "resolver/level_qp.py": "weights of the proximal term that are tried in turn",
    "solver/": "settings of solvers by others, in the words of their manuals",
    "testing/": "steps of differences, and accuracies that a check asks for",
}


def small_literals(source: str) -> list[float]:
    """The float literals below `SMALL` of a module, zero left out."""
    nodes = ast.walk(ast.parse(source))
    values = [
        node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, float)
    ]
    return [value for value in values if 0.0 < value < SMALL]


def entries(source: str) -> Iterator[tuple[str, str]]:
    """Name and docstring of each constant of a table; the docstring is the text that follows it, or empty."""
    body = ast.parse(source).body
    for statement, after in zip(body, [*body[1:], ast.Pass()], strict=True):
        if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
            is_text = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
            yield statement.targets[0].id, str(after.value.value) if is_text else ""


def unexplained(source: str) -> list[str]:
    """Constants of a table without a docstring of at least one full sentence."""
    return [name for name, text in entries(source) if len(text.split()) < 8 or "." not in text]


def test_no_module_beside_the_table_has_a_tolerance() -> None:
    """A float below 1e-3 stands in `hierarchy/tolerances.py`, or is no tolerance, as said above."""
    modules = {path.relative_to(PACKAGE).as_posix(): path for path in PACKAGE.rglob("*.py") if path != TABLE}
    assert len(modules) > 80
    found = {name: values for name, path in modules.items() if (values := small_literals(path.read_text()))}
    assert {name: values for name, values in found.items() if not name.startswith(tuple(ALLOWED))} == {}
    assert [part for part in ALLOWED if not any(name.startswith(part) for name in found)] == []


def test_every_tolerance_says_what_it_decides() -> None:
    """A docstring of a sentence at least follows each of them, and each is a positive number."""
    source = TABLE.read_text()
    assert unexplained(source) == []
    values = {name: getattr(tolerances, name) for name, _ in entries(source)}
    assert len(values) > 20
    assert all(isinstance(value, float) and value > 0.0 for value in values.values())


def test_every_tolerance_is_used() -> None:
    """Some module of the package imports it."""
    sources = [path.read_text() for path in PACKAGE.rglob("*.py") if path != TABLE]
    unused = [
        name
        for name, _ in entries(TABLE.read_text())
        if not any(re.search(rf"\b{name}\b", text) for text in sources)
    ]
    assert unused == []


def test_a_planted_tolerance_is_found() -> None:
    """As a constant, in an expression and as a default; 1e-3 and 0.0 are none."""
    source = "A = 1e-9\ndef f(x, eps=-2e-5):\n    return x < 1e-12 * max(1.0, x) + 0.0 + 1e-3\n"
    assert sorted(small_literals(source)) == [1e-12, 1e-9, 2e-5]


def test_a_planted_constant_without_reason_is_found() -> None:
    """Without a text, and with one that says nothing."""
    source = (
        'A = 1.0\nB = 2.0\n"""Small."""\nC = 3.0\n"""It decides what a row is, and more of it is worse."""\n'
    )
    assert unexplained(source) == ["A", "B"]
