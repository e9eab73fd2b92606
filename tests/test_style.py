"""The house rules that a program can check, each with the fault that it must catch."""

import ast
import re
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from itertools import accumulate
from pathlib import Path
from statistics import median

import pytest

import taskopt

ROOT = Path(__file__).parents[1]
PACKAGE = sorted(Path(taskopt.__file__).parent.rglob("*.py"))
TESTS = sorted((ROOT / "tests").rglob("*.py"))
TASKS = sorted((ROOT / "tasks").glob("*.py"))
EVERYTHING = [*PACKAGE, *TESTS, *TASKS]
FUNCTION_LINES = 39  # lines of code of a function, compiled or not
MODULE_LINES = 300  # lines of code of a module
PARAMETERS = 8  # of a function, self included
DECLARED_LAZY = (  # commands import what they need, so that --help is quick
    "taskopt/bench/commands.py",
    "taskopt/bench/comparison/commands.py",
    "taskopt/bench/sweep/commands.py",
    "taskopt/cli.py",
    "taskopt/log_commands.py",
    "taskopt/run_commands.py",
    "taskopt/view_command.py",
)  # fmt: skip
OLD_WORDS = (
    "twin", "leak", "chatter", "settle", "nudge", "pardon", "restated", "flatten", "unanswered", "swings",
    "dead row", "take in", "let go",
)  # fmt: skip


@cache
def parsed(source: str) -> ast.Module:
    """Syntax tree of a source, which every rule reads and none changes."""
    return ast.parse(source)


@cache
def nodes(source: str) -> tuple[ast.AST, ...]:
    """All nodes of the tree."""
    return tuple(ast.walk(parsed(source)))


@cache
def functions(source: str) -> tuple[ast.FunctionDef, ...]:
    return tuple(node for node in nodes(source) if isinstance(node, ast.FunctionDef))


def is_kernel(node: ast.FunctionDef) -> bool:
    return any("kernel" in ast.unparse(decorator) for decorator in node.decorator_list)


@cache
def lines_until(source: str) -> tuple[int, ...]:
    """Number of lines of code up to each line, without comments, blank lines and strings that document."""
    counts = [line.strip()[:1] not in ("", "#") for line in source.splitlines()]
    for node in nodes(source):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            first, last = node.lineno - 1, node.end_lineno or node.lineno
            counts[first:last] = [False] * (last - first)
    return 0, *accumulate(counts)


def code_lines(source: str, node: ast.FunctionDef | None = None) -> int:
    """Number of lines of code of a module, or of one function in it."""
    until = lines_until(source)
    return until[-1] if node is None else until[node.end_lineno or 0] - until[node.lineno - 1]


def long_module(source: str) -> list[str]:
    lines = code_lines(source)
    return [f"{lines} lines of code"] if lines > MODULE_LINES else []


def long_functions(source: str) -> list[str]:
    return [
        f"{node.name}: {lines} lines of code"
        for node in functions(source)
        if (lines := code_lines(source, node)) > FUNCTION_LINES
    ]


def many_parameters(source: str) -> list[str]:
    """Functions with too many parameters; those of a command are options, which nobody gives by place."""
    found = []
    for node in functions(source):
        if any(".command(" in ast.unparse(decorator) for decorator in node.decorator_list):
            continue
        arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        if len(arguments) > PARAMETERS:
            found.append(f"{node.name}: {len(arguments)} parameters")
    return found


def hidden_imports(source: str) -> list[str]:
    """Imports of our own modules inside a function, which hide a circle from the contracts."""
    return [
        f"{node.name} imports {inner.module}"
        for node in functions(source)
        for inner in ast.walk(node)
        if isinstance(inner, ast.ImportFrom) and (inner.module or "").split(".")[0] == "taskopt"
    ]


def missing_sections(source: str, documented: frozenset[str] = frozenset()) -> list[str]:
    """Public functions whose docstring lacks Args or Returns, and public records without Attributes.

    A method that implements one of a base class may refer to it: `documented` has the names of methods
    whose sections stand in another class.
    """
    found = []
    for owner, node in public_definitions(parsed(source)):
        text = ast.get_docstring(node) or ""
        if isinstance(node, ast.ClassDef):
            fields = [
                n for n in node.body if isinstance(n, ast.AnnAssign) and "ClassVar" not in ast.unparse(n)
            ]
            if fields and not has_section(text, "Attributes|Args"):
                found.append(f"{node.name} lacks Attributes")
            continue
        decorators = {ast.unparse(d).split("(")[0] for d in node.decorator_list}
        if not text and node.name not in documented:
            found.append(f"{owner}{node.name} lacks a docstring")
        if decorators & {"property", "cached_property", "overload"} or node.name in documented:
            continue
        if any(name.endswith(".command") for name in decorators):  # its help is made from the parameters
            continue
        arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        named = [a for a in arguments if a.arg not in ("self", "cls")]
        gives = node.returns is not None and ast.unparse(node.returns) not in ("None", "NoReturn")
        if named and not has_section(text, "Args"):
            found.append(f"{owner}{node.name} lacks Args")
        if named and gives and not has_section(text, "Returns|Yields"):
            found.append(f"{owner}{node.name} lacks Returns")
    return found


def has_section(text: str, names: str) -> bool:
    return re.search(rf"^({names}):$", text, re.MULTILINE) is not None


def documented_methods(sources: list[str]) -> frozenset[str]:
    """Names of methods whose docstring has sections in some class."""
    return frozenset(
        node.name
        for source in sources
        for owner, node in public_definitions(parsed(source))
        if owner and has_section(ast.get_docstring(node) or "", "Args|Returns|Raises")
    )


def public_definitions(tree: ast.Module) -> Iterator[tuple[str, ast.ClassDef | ast.FunctionDef]]:
    """Public classes and functions of a module, and the public methods of public classes."""
    for node in tree.body:
        if not isinstance(node, ast.ClassDef | ast.FunctionDef) or node.name.startswith("_"):
            continue
        yield "", node
        if isinstance(node, ast.ClassDef):
            for method in node.body:
                if isinstance(method, ast.FunctionDef) and not method.name.startswith("_"):
                    yield f"{node.name}.", method


def old_words(source: str) -> list[str]:
    """Words that the glossary of the project replaced by terms of the field."""
    return re.findall(rf"\b(?:{'|'.join(OLD_WORDS)})(?:s|d|ed|ing)?\b", source.lower())


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
    tree = parsed(source)
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
    words = ("assert", "raises", "check", "warns", "proven")
    return [
        node.name
        for node in functions(source)
        if node.name.startswith("test_") and not any(word in ast.unparse(node.body) for word in words)
    ]


def dead_weight(source: str) -> list[str]:
    marks = r"^#!|\bT[O]DO\b|\bF[I]XME\b|\bX[X]X\b|/(?:w[o]rk|h[o]me|r[o]ot|t[m]p)/"
    return [line.strip() for line in source.splitlines() if re.search(marks, line)]


def docstrings(source: str) -> Iterator[str]:
    for node in nodes(source):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            yield from (re.sub(r"\s+", " ", part) for part in (ast.get_docstring(node) or "").split("\n\n"))


def repeated(sources: list[str]) -> list[str]:
    sections = re.compile(r"(Args|Returns|Yields|Raises|Attributes|Source):")
    count = Counter(
        part
        for source in sources
        for part in docstrings(source)
        if len(part) > 80 and not sections.match(part)
    )
    return [part for part, times in count.items() if times > 1]


def control_flow(source: str) -> list[str]:
    kinds = (ast.If, ast.For, ast.While, ast.Try, ast.With)
    return [ast.unparse(node)[:60] for node in nodes(source) if isinstance(node, kinds)]


@cache
def read(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def where(path: Path) -> str:
    package = Path(taskopt.__file__).parent
    return str(path.relative_to(package.parent if path.is_relative_to(package) else ROOT))


@pytest.mark.parametrize(
    "rule",
    [long_module, long_functions, many_parameters, unannotated, undocumented, dead_weight, old_words],
)
def test_the_package_keeps_the_house_rules(rule: Callable[[str], list[str]]) -> None:
    """Modules and functions are small, annotated, documented, and carry nothing dead."""
    assert {where(path): faults for path in PACKAGE if (faults := rule(read(path)))} == {}


def test_docstrings_have_their_sections() -> None:
    """What a public function takes and gives is said in Args and Returns, and fields in Attributes."""
    known = documented_methods([read(path) for path in PACKAGE])
    assert {where(path): faults for path in PACKAGE if (faults := missing_sections(read(path), known))} == {}


def test_no_import_hides_in_a_function() -> None:
    """A circle of imports cannot hide from the contracts; commands of the program import what they need."""
    kept = [path for path in PACKAGE if where(path) not in DECLARED_LAZY]
    assert {where(path): faults for path in kept if (faults := hidden_imports(read(path)))} == {}


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
    """Half of the modules have at most 100 lines of code, half of the functions at most ten."""
    sources = [read(path) for path in PACKAGE if path.name != "__init__.py"]
    assert median(code_lines(source) for source in sources) <= 100
    bodies = [code_lines(source, node) - 1 for source in sources for node in functions(source)]
    assert median(bodies) <= 10


@pytest.mark.parametrize(
    ("rule", "fault"),
    [
        (long_module, "x = 1\n" * (MODULE_LINES + 1)),
        (long_functions, "def f() -> None:\n" + "    x = 1\n" * FUNCTION_LINES),
        (long_functions, "@kernel\ndef f(x):\n" + "    x = 1\n" * FUNCTION_LINES),
        (unannotated, "def f(x) -> None: ..."),
        (unannotated, "def f(x: int): ..."),
        (undocumented, '"""Module."""\nclass A: ...'),
        (many_parameters, f"def f({', '.join(f'x{i}: int' for i in range(PARAMETERS + 1))}) -> None: ..."),
        (hidden_imports, "def f() -> None:\n    from taskopt.errors import TaskoptError"),
        (missing_sections, 'def f(x: int) -> None:\n    """Do it."""'),
        (missing_sections, 'def f(x: int) -> int:\n    """Do it.\n\n    Args:\n        x: Number.\n    """'),
        (missing_sections, 'class A:\n    """Record."""\n    x: int'),
        (old_words, "# the twin of it"),
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
