"""The house rules that a program can check, each with the fault that it must catch."""

import ast
import re
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = sorted((ROOT / "taskopt").rglob("*.py"))
TESTS = sorted((ROOT / "tests").rglob("*.py"))
TASKS = sorted((ROOT / "tasks").glob("*.py"))
EVERYTHING = [*PACKAGE, *TESTS, *TASKS]
KERNEL_LINES = 120  # a scalar algorithm written out, to be read beside its paper


def functions(source: str) -> Iterator[ast.FunctionDef]:
    yield from (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.FunctionDef))


def is_kernel(node: ast.FunctionDef) -> bool:
    return any("kernel" in ast.unparse(decorator) for decorator in node.decorator_list)


def long_module(source: str) -> list[str]:
    lines = source.count("\n")
    return [f"{lines} lines"] if lines > 300 else []


def long_functions(source: str) -> list[str]:
    return [
        f"{node.name}: {lines} lines"
        for node in functions(source)
        if (lines := (node.end_lineno or 0) - node.lineno) >= (KERNEL_LINES if is_kernel(node) else 40)
    ]


def unannotated(source: str) -> list[str]:
    found = []
    for node in functions(source):
        if is_kernel(node):
            continue
        arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        bare = [a.arg for a in arguments if a.annotation is None and a.arg not in ("self", "cls")]
        if bare or node.returns is None:
            found.append(f"{node.name}({', '.join(bare)})")
    return found


def undocumented(source: str) -> list[str]:
    tree = ast.parse(source)
    public = [
        node
        for node in tree.body
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_")
    ]
    missing = [node.name for node in public if not ast.get_docstring(node)]
    return missing if ast.get_docstring(tree) or not tree.body else ["the module", *missing]


def untold_tests(source: str) -> list[str]:
    return [
        node.name
        for node in functions(source)
        if node.name.startswith("test_") and not ast.get_docstring(node)
    ]


def idle_tests(source: str) -> list[str]:
    """Tests without an assertion: neither assert, nor raises, nor a helper that says it asserts."""
    words = ("assert", "raises", "check", "warns")
    return [
        node.name
        for node in functions(source)
        if node.name.startswith("test_") and not any(word in ast.unparse(node.body) for word in words)
    ]


def dead_weight(source: str) -> list[str]:
    marks = r"^#!|\bT[O]DO\b|\bF[I]XME\b|\bX[X]X\b|/(?:w[o]rk|h[o]me|r[o]ot|t[m]p)/"
    return [line.strip() for line in source.splitlines() if re.search(marks, line)]


def docstrings(source: str) -> Iterator[str]:
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            yield from (re.sub(r"\s+", " ", part) for part in (ast.get_docstring(node) or "").split("\n\n"))


def repeated(sources: list[str]) -> list[str]:
    count = Counter(part for source in sources for part in docstrings(source) if len(part) > 80)
    return [part for part, times in count.items() if times > 1]


def control_flow(source: str) -> list[str]:
    kinds = (ast.If, ast.For, ast.While, ast.Try, ast.With)
    return [ast.unparse(node)[:60] for node in ast.walk(ast.parse(source)) if isinstance(node, kinds)]


def read(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def where(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("rule", [long_module, long_functions, unannotated, undocumented, dead_weight])
def test_the_package_keeps_the_house_rules(rule: Callable[[str], list[str]]) -> None:
    """Modules and functions are small, annotated, documented, and carry nothing dead."""
    assert {where(path): faults for path in PACKAGE if (faults := rule(read(path)))} == {}


@pytest.mark.parametrize("rule", [long_functions, untold_tests, idle_tests, dead_weight])
def test_tests_say_what_must_be_true(rule: Callable[[str], list[str]]) -> None:
    """Every test states its theorem in a docstring and asserts something."""
    assert {where(path): faults for path in TESTS if (faults := rule(read(path)))} == {}


def test_scenarios_are_declarations() -> None:
    """A scenario file has at most 45 lines and no control flow."""
    assert {where(path): faults for path in TASKS if (faults := control_flow(read(path)))} == {}
    assert {where(path): n for path in TASKS if (n := read(path).count("\n")) > 45} == {}


def test_no_paragraph_stands_twice() -> None:
    """What is said is said once."""
    assert repeated([read(path) for path in PACKAGE]) == []


def test_modules_are_small_in_the_middle() -> None:
    """Half of the modules have at most 100 lines, half of the functions at most ten."""
    sources = [read(path) for path in PACKAGE if path.name != "__init__.py"]
    assert median(source.count("\n") for source in sources) <= 100
    bodies = [(node.end_lineno or 0) - node.body[0].lineno + 1 for s in sources for node in functions(s)]
    assert median(bodies) <= 10


@pytest.mark.parametrize(
    ("rule", "fault"),
    [
        (long_module, "\n" * 301),
        (long_functions, "def f() -> None:\n" + "    x = 1\n" * 40),
        (long_functions, "@kernel\ndef f(x):\n" + "    x = 1\n" * KERNEL_LINES),
        (unannotated, "def f(x) -> None: ..."),
        (unannotated, "def f(x: int): ..."),
        (undocumented, '"""Module."""\nclass A: ...'),
        (undocumented, "x = 1"),
        (untold_tests, "def test_a(): assert True"),
        (idle_tests, "def test_a():\n    run()"),
        (dead_weight, "#!/usr/bin/env python"),
        (dead_weight, "x = 1  # T" + "ODO later"),
        (dead_weight, "open('/h" + "ome/me/robot.urdf')"),
        (control_flow, "if True:\n    scenario = 1"),
        (lambda source: repeated([source, source]), f'"""{"again " * 20}"""'),
    ],
)
def test_each_rule_catches_its_fault(rule: Callable[[str], list[str]], fault: str) -> None:
    """A rule that cannot fail is no rule."""
    assert rule(fault)
