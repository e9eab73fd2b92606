"""The one place where the numeric core is compiled from Python source, with Numba.

    @kernel        merged into every kernel that calls it; for short functions
    @kernel_apart  compiled once and called by name; for long functions
    @kernel_exact  as `kernel`, with every operation as written; for error-free arithmetic
    @kernel_unlocked  as `kernel_apart`, without Python's lock; for work that threads share

A kernel is compiled at its first call, or loaded if any process of the user has compiled the same content
before (`store`). Its stamp is a digest of everything that can change the machine code: its own code, the
constants that it reads, the same of all kernels that it calls (`content`), compile options, and the versions
of Python, NumPy, Numba and of this package `jit`.

With NUMBA_DISABLE_JIT=1 a kernel is the plain Python function, hundreds of times slower, for a debugger or
for coverage.

Numba's internals are used in this file only, and `pyproject.toml` bounds its version for this reason:

- `Kernel` is a dispatcher whose attribute `_cache` is our own; Numba's caches look at one source file, while
  a kernel depends on many.
- Numba links the intermediate code of each callee into each caller and optimises it again. An apart kernel
  is therefore registered without its library, so that callers refer to its machine code by name.
- Numba writes for each function another one that takes Python objects apart, which is a quarter of all
  compilation. Compiled callers do not need it, so a kernel has two forms: itself, for calls from Python,
  and `for_callers`, which is the one that compiled code sees.
- Such a name must be the same in all processes, since callers keep it in their files: `_Compiler` puts the
  stamp where Numba puts a running number. A file also lists the kernels that its machine code calls by
  name; they are loaded, or compiled, before it.
"""

import hashlib
import pickle
import platform
import re
import sys
from collections.abc import Callable, Iterator
from functools import cached_property
from pathlib import Path
from typing import TypeVar, cast

import llvmlite
import numba
import numpy as np
from numba.core import config, types
from numba.core.caching import _Cache
from numba.core.codegen import CPUCodegen
from numba.core.compiler import Compiler, CompileResult
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager
from numba.core.cpu import CPUContext
from numba.core.errors import NumbaError
from numba.core.registry import CPUDispatcher
from numba.core.serialize import dumps
from numba.core.sigutils import normalize_signature
from numba.core.typing.templates import Signature

from taskopt.errors import InvalidValue
from taskopt.jit.content import Content, Reader
from taskopt.jit.progress import Report, Stopwatch
from taskopt.jit.store import Store, users_folder

F = TypeVar("F", bound=Callable[..., object])
COMPILED = not vars(config)["DISABLE_JIT"]
"""False where NUMBA_DISABLE_JIT=1 runs kernels as plain Python."""
Types = tuple[types.Type, ...] | Signature  # of the arguments of a call


class _Flags(set[str]):
    """Compile options in an order that does not change from process to process: Numba puts it into names."""

    def __repr__(self) -> str:
        return repr(sorted(self))


# IEEE arithmetic, where a division by zero gives inf; sums may be reordered, so that they are vectorised.
_FAST = _Flags({"reassoc", "contract"})
_OPTIONS = {"nopython": True, "boundscheck": None, "error_model": "numpy", "no_cfunc_wrapper": True}

_report = Report()
_preparing = Stopwatch()
_store = Store(users_folder(str(vars(config)["CACHE_DIR"])))


def kernel(function: F) -> F:
    """Compile a function that is merged into the kernels that call it.

    A call with a dozen arrays costs as much as ten short rows, so this is the default.

    Args:
        function: A function that Numba can compile.

    Returns:
        The kernel, called as the function is; the function itself where compilation is disabled.
    """
    return _compiled(function, apart=False)


def kernel_apart(function: F) -> F:
    """Compile a function that stays a call; merging it would lengthen the compilation of its callers.

    Args:
        function: A function that Numba can compile.

    Returns:
        The kernel, called as the function is; the function itself where compilation is disabled.
    """
    return _compiled(function, apart=True)


def kernel_exact(function: F) -> F:
    """Compile a function whose floating-point operations are neither reordered nor fused.

    Error-free transformations, such as the exact error of a sum, vanish if a compiler simplifies them. All
    functions that such a kernel calls must be compiled in the same way.

    Args:
        function: A function that Numba can compile.

    Returns:
        The kernel, called as the function is; the function itself where compilation is disabled.
    """
    return _compiled(function, apart=False, fast=False)


def kernel_unlocked(function: F) -> F:
    """Compile a function that releases Python's global lock while it runs, so that threads run it at once.

    No thread may write what another one reads meanwhile.

    Args:
        function: A function that Numba can compile.

    Returns:
        The kernel, called as the function is; the function itself where compilation is disabled.
    """
    return _compiled(function, apart=True, unlocked=True)


def nanoseconds_preparing() -> int:
    """Return how long this process has been compiling kernels, or loading compiled ones.

    Whoever times a call subtracts what this has grown by meanwhile: preparing a kernel is no part of its run.

    Returns:
        The time so far [ns].
    """
    return _preparing.nanoseconds


def _compiled(function: F, *, apart: bool, fast: bool = True, unlocked: bool = False) -> F:
    """Return the kernel of a function, or the function itself where compilation is disabled."""
    if not COMPILED:
        return function
    made = Kernel(function, apart=apart, fast=fast)
    made.targetoptions["nogil"] = unlocked
    return cast("F", made)


class _Compiler(Compiler):
    """Numba's compiler with names of machine code that depend on the content only."""

    def define_pipelines(self) -> list[PassManager]:
        """Put the stamp in place of the running number, then go on as usual."""
        identity = self.state.func_id
        kernel = identity.func.kernel
        form = kernel.for_callers if self.state.flags.no_cpython_wrapper else kernel
        identity.unique_id = form.stamp
        return super().define_pipelines()


class Kernel(CPUDispatcher):
    """A compiled function.

    Args:
        function: The Python function.
        apart: Whether callers call it by name instead of merging it.
        fast: Whether sums may be reordered and products fused with sums.
        python: Whether Python can call it; False for the form that compiled callers see.
    """

    def __init__(
        self, function: Callable[..., object], *, apart: bool, fast: bool = True, python: bool = True
    ) -> None:
        fastmath = _FAST if fast else False
        own = {"forceinline": not apart, "fastmath": fastmath, "no_cpython_wrapper": not python}
        super().__init__(function, targetoptions=_OPTIONS | own, pipeline_class=_Compiler)
        self.apart = apart
        self.fast = fast
        self.python = python
        self._cache = _KernelCache(self)
        self.for_callers = Kernel(function, apart=apart, fast=fast, python=False) if python else self
        function.kernel = self  # type: ignore[attr-defined]

    def __reduce__(self) -> str:
        """Pickle and copy by name, as a function."""
        return self.__qualname__ if self.python else f"{self.__qualname__}.for_callers"

    @property
    def _numba_type_(self) -> types.Dispatcher:
        """Type of the kernel in compiled code."""
        return types.Dispatcher(self.for_callers)

    @cached_property
    def content(self) -> Content:
        """Its own code and constants, and the kernels that it calls."""
        return _reader.read(self.py_func)

    @cached_property
    def callees(self) -> "dict[str, Kernel]":
        """All kernels that it calls, directly or through others, by stamp."""
        return {callee.stamp: callee for callee in self._reachable() if callee is not self.for_callers}

    @cached_property
    def stamp(self) -> str:
        """Digest of everything that decides the machine code, apart from the processor."""
        parts = sorted(
            f"{reached.apart} {reached.fast} {reached.content.text}" for reached in self._reachable()
        )
        unlocked = self.targetoptions.get("nogil", False)
        own = f"{self.targetoptions['forceinline']} {self.fast} {self.python} {unlocked}"
        text = "\n".join([_environment(), own, self.content.text, *parts])
        return hashlib.sha256(text.encode()).hexdigest()[:24]

    def _reachable(self) -> "list[Kernel]":
        """Return this kernel and all that it calls, directly or through others, in the form for callers."""
        found: dict[Kernel, None] = {self.for_callers: None}
        waiting = list(found)
        while waiting:
            for callee in waiting.pop().called_directly():
                if callee not in found:
                    found[callee] = None
                    waiting.append(callee)
        return list(found)

    @property
    def filename(self) -> str:
        """Beginning of the names of its files."""
        return f"{self.__module__}.{self.__qualname__}-{self.stamp}-"

    def called_directly(self) -> "list[Kernel]":
        """Return the kernels that its own code names, in the form for callers."""
        return [callee.for_callers for callee in cast("list[Kernel]", self.content.callees)]

    def called_by_name(self) -> "Iterator[Kernel]":
        """Yield the apart kernels that the machine code calls, itself or in a kernel merged into it."""
        found: set[Kernel] = {self.for_callers}
        waiting = list(found)
        while waiting:
            for callee in waiting.pop().called_directly():
                if callee in found:
                    continue
                found.add(callee)
                if callee.apart:
                    yield callee
                else:
                    waiting.append(callee)

    def compile(self, sig: Types) -> object:
        """Compile or load the machine code for a signature; the outermost call reports it.

        Args:
            sig: Types of the arguments.

        Returns:
            The entry point of the machine code.

        Raises:
            InvalidValue: This kernel, or one that it calls, is not such that it can be compiled.
        """
        with global_compiler_lock, _preparing:
            outermost = not _report.running
            try:
                return super().compile(sig)
            except (NumbaError, NotImplementedError) as error:
                if outermost:
                    raise InvalidValue(_in_short(str(error))) from error
                raise
            finally:
                if outermost and _report.running:
                    _report.end()

    def add_overload(self, cres: CompileResult) -> None:
        """Register machine code; that of an apart kernel is for callers a name, not code to merge.

        Args:
            cres: What the compiler made of one signature.
        """
        if self.python:
            super().add_overload(cres)
        else:
            self.overloads[tuple(cres.signature.args)] = cres
        if self.apart:
            self.targetctx.remove_user_function(cres.entry_point)
            self.targetctx.insert_user_function(cres.entry_point, cres.fndesc, ())


class _KernelCache(_Cache):
    """The compiled signatures of one kernel in the folder of the user."""

    def __init__(self, owner: Kernel) -> None:
        self._owner = owner

    @property
    def cache_path(self) -> str:
        """Folder of the files."""
        return str(_store.folder or "")

    def load_overload(self, sig: Types, target_context: CPUContext) -> CompileResult | None:
        """Return the machine code for a signature, after that of all kernels which it calls by name."""
        target_context.refresh()
        data = _store.read(self._file(sig, target_context.codegen()))
        found = self._rebuilt(data, target_context) if data is not None else None
        if found is None:
            if not _report.running:
                _report.begin(_missing(self._owner), self.cache_path, kept=_store.writable)
            _report.compiling(self._owner.__name__)
        return found

    def _rebuilt(self, data: bytes, target_context: CPUContext) -> CompileResult | None:
        """Load callees, then the machine code itself; None if a callee has another name than it had."""
        called, reduced = pickle.loads(data)
        for stamp, arguments, symbol in called:
            callee = self._owner.callees[stamp]
            callee.compile(arguments)
            if callee.overloads[arguments].fndesc.mangled_name != symbol:
                return None
        return CompileResult._rebuild(target_context, *pickle.loads(reduced))

    def save_overload(self, sig: Types, data: CompileResult) -> None:
        """Keep the machine code of a signature."""
        _report.compiled()
        if data.library.has_dynamic_globals or data.lifted or not _stands_in_a_module(self._owner.py_func):
            return  # it holds addresses of this process, or names that no other process knows
        called = [
            (callee.stamp, arguments, result.fndesc.mangled_name)
            for callee in self._owner.called_by_name()
            for arguments, result in callee.overloads.items()
        ]
        _store.write(self._file(sig, data.codegen), dumps((called, dumps(data._reduce()))))

    def _file(self, sig: Types, codegen: CPUCodegen) -> str:
        """Name of the file for a signature on this processor."""
        arguments, _ = normalize_signature(sig)
        text = f"{[_describe(argument) for argument in arguments]} {codegen.magic_tuple()}"
        return f"{self._owner.filename}{hashlib.sha256(text.encode()).hexdigest()[:16]}"

    def enable(self) -> None:
        """Do nothing: the cache is always enabled."""

    def disable(self) -> None:
        """Do nothing: the cache is always enabled."""

    def flush(self) -> None:
        """Do nothing: files never go stale, and `Store.clean` deletes the old ones."""


def _stands_in_a_module(function: Callable[..., object]) -> bool:
    """Return False for a function of executed text, such as a snippet, whose names nobody can import."""
    module = sys.modules.get(function.__module__ or "")
    return module is not None and vars(module) is function.__globals__


def _in_short(message: str) -> str:
    """Return what Numba found, and the line of the source where it did, out of its page-long message."""
    lines = [line.strip(" >") for line in message.splitlines() if line.strip(" >")]
    found = [line for line in lines if not line.startswith("Failed in")]
    what = " ".join(found[:2]) if found[0].endswith(":") else found[0]
    place = re.search(r"During: .* at (.+) \((\d+)\)", message)
    where = f" ({place[1]}, line {place[2]})" if place else ""
    return (
        f"a kernel cannot be compiled{where}: {what}; it may use numbers, arrays and tuples, and a name "
        "has one type only; NUMBA_DISABLE_JIT=1 runs it as plain Python in a debugger"
    )


def _describe(argument: types.Type) -> str:
    """Describe the type of an argument; Numba's own name of a named tuple leaves out the fields."""
    fields = getattr(argument, "fields", "")
    inside = [_describe(part) for part in getattr(argument, "types", ())]
    return f"{argument} {fields} {inside}"


def _missing(outermost: Kernel) -> int:
    """Count the kernels that must be compiled before a kernel can run."""
    names = {name.rpartition("-")[0] for name in _store.names()}
    waiting = [outermost, *outermost.callees.values()]
    return sum(not found.overloads and found.filename.rstrip("-") not in names for found in waiting)


def _environment() -> str:
    """Describe what the machine code depends on besides the kernels."""
    versions = platform.python_version(), np.__version__, numba.__version__, llvmlite.__version__
    settings = [str(vars(config)[name]) for name in _SETTINGS]
    return f"{versions} {settings} {_OWN}"


_SETTINGS = "OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "BOUNDSCHECK", "DEBUGINFO_DEFAULT"
_OWN = hashlib.sha256(
    b"".join(path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
).hexdigest()
_reader = Reader(lambda value: isinstance(value, Kernel))
