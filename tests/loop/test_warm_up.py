"""The warm-up compiles every kernel of the package."""

import os
import subprocess
import sys

import pytest

CHECK = """
from importlib import import_module
from pkgutil import walk_packages

import taskopt
from taskopt.jit import Kernel
from taskopt.loop.warm_up import warm_up

{fault}
warm_up()
modules = [import_module(found.name) for found in walk_packages(taskopt.__path__, "taskopt.")]
kernels = {{value for module in modules for value in vars(module).values() if isinstance(value, Kernel)}}
compiled = {{one for one in kernels if one.overloads}}
compiled |= {{callee for one in compiled for callee in one.callees.values()}}
print(*sorted(one.__qualname__ for one in kernels - compiled))
"""


def not_compiled(fault: str = "") -> list[str]:
    """Kernels that a new process has not compiled after the warm-up."""
    done = subprocess.run(
        [sys.executable, "-c", CHECK.format(fault=fault)], capture_output=True, text=True, check=True
    )
    return done.stdout.split()


@pytest.mark.slow
@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is compiled")
def test_every_kernel_is_compiled() -> None:
    """After the warm-up each kernel has machine code, its own or within that of a kernel which calls it."""
    # Some plans need these, not all; or they are merged into kernels that are made for one plan.
    assert set(not_compiled()) <= {"box_of", "_no_rows", "_no_bounds", "problem_in"}


@pytest.mark.slow
@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is compiled")
def test_planted_fault_a_stack_is_left_out() -> None:
    """Without the last stack, kernels of its tasks are missing."""
    fault = "from taskopt.loop import warm_up as w; all = w._stacks; w._stacks = lambda: list(all())[:-1]"
    assert "gaze_into" in not_compiled(fault)
