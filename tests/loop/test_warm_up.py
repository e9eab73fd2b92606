"""The warm-up compiles every kernel of the package."""

import os
import subprocess
import sys

import pytest

CHECK = '''
from importlib import import_module
from pkgutil import walk_packages
from types import CodeType, FunctionType

import taskopt
from taskopt.jit import Kernel
from taskopt.loop.warm_up import warm_up

def names(code):
    """Yield the names that a function reads from its module, and those of functions inside it."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from names(constant)

def called(module):
    """Yield the kernels whose names are read by the Python code of a module."""
    places = [vars(module), *(vars(value) for value in vars(module).values() if isinstance(value, type))]
    for value in [value for place in places for value in place.values()]:
        function = getattr(value, "fget", None) or getattr(value, "func", None) or value
        function = getattr(function, "__func__", function)
        if isinstance(function, FunctionType) and function.__module__ == module.__name__:
            read = (function.__globals__.get(name) for name in names(function.__code__))
            yield from (value for value in read if isinstance(value, Kernel))

{fault}
warm_up()
modules = [import_module(found.name) for found in walk_packages(taskopt.__path__, "taskopt.")]
kernels = {{value for module in modules for value in vars(module).values() if isinstance(value, Kernel)}}
compiled = {{one for one in kernels if one.overloads or one.for_callers.overloads}}
within = {{callee for one in compiled for callee in one.callees.values()}}
print(*sorted(one.__qualname__ for one in kernels - compiled if one.for_callers not in within))
print(*sorted({{one.__qualname__ for module in modules for one in called(module) if not one.overloads}}))
'''


def not_compiled(fault: str = "") -> tuple[set[str], set[str]]:
    """Kernels that a new process has not compiled after the warm-up: at all, and for calls from Python."""
    done = subprocess.run(
        [sys.executable, "-c", CHECK.format(fault=fault)], capture_output=True, text=True, check=True
    )
    nowhere, python = done.stdout.split("\n")[:2]
    return set(nowhere.split()), set(python.split())


@pytest.mark.slow
@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is compiled")
def test_every_kernel_is_compiled() -> None:
    """After the warm-up each kernel has machine code, its own or within that of a kernel which calls it."""
    nowhere, python = not_compiled()
    # Some plans need these, not all; or they are merged into kernels that are made for one plan.
    assert nowhere <= {"box_of", "_no_rows", "_no_bounds", "_no_lift", "lift_box", "problem_in"}
    # Python code hands these to a plan, and calls them only for a task or limit without a plan.
    of_parts = {"centre_of_mass_rows", "joint_rows", "narrow_by_acceleration", "narrow_by_radius"}
    of_parts |= {"frame_lift", "joint_lift", "standing_rows", "velocity_lift", "rows_from_memory"}  # order 2
    of_one_plan = {"box_of", "_no_rows", "_no_bounds", "_no_lift"}  # named in functions that make its kernels
    assert python <= of_parts | of_one_plan | {"narrow_to_speeds"}


@pytest.mark.slow
@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is compiled")
def test_planted_fault_a_stack_is_left_out() -> None:
    """Without the last stack, kernels of its tasks are missing."""
    fault = "from taskopt.loop import warm_up as w; all = w._stacks; w._stacks = lambda: list(all())[:-1]"
    assert "gaze_into" in not_compiled(fault)[0]


@pytest.mark.slow
@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is compiled")
def test_planted_fault_only_compiled_code_calls_a_kernel() -> None:
    """Without a resolver in Python, the form of the certificate that Python calls is missing."""
    fault = "from taskopt.loop import warm_up as w; w.islice = lambda *_: ()"
    assert "certify_kernel" in not_compiled(fault)[1]
