"""The one place where our numeric core is compiled from Python source.

Interpreted, the kernels are hundreds of times slower, so there is no second speed to fall back
to: they are compiled on first use, the machine code is cached on disk, and a line on stderr says
so while it happens.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core import event
from numba.core.dispatcher import Dispatcher


class _Announce(event.Listener):
    """Say once that a compilation has begun; loading from the cache raises no such event."""

    def __init__(self) -> None:
        self.said = False

    def on_start(self, event: object) -> None:
        if not self.said:
            self.said = True
            print("compiling the numeric core, once for this machine …", file=sys.stderr, flush=True)

    def on_end(self, event: object) -> None:
        pass


event.register("numba:compile", _Announce())


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile with Numba: IEEE arithmetic, division by zero gives inf, cached on disk.

    It is merged into the kernels that call it, since a call with a dozen arrays costs what ten small
    rows do.
    """
    return _compiled(function, merged=True)


def kernel_apart(function: Callable[..., Any]) -> Callable[..., Any]:
    """A kernel that is long enough to stay a call: merged too, it would double the time to compile."""
    return _compiled(function, merged=False)


def _compiled(function: Callable[..., Any], *, merged: bool) -> Callable[..., Any]:
    compiled = numba.njit(
        cache=True, error_model="numpy", fastmath={"reassoc", "contract"}, forceinline=merged
    )(function)
    _watch_callees(compiled)
    return compiled


_sources: dict[Any, frozenset[str]] = {}  # kernel: its file, and those of the kernels it may call


def _watch_callees(compiled: Any) -> None:
    """Let the cache of a kernel go stale with its callees' files too; Numba looks at its own only."""
    function = compiled.py_func
    callees = (value for value in function.__globals__.values() if isinstance(value, Dispatcher))
    files = frozenset({function.__code__.co_filename}).union(*(_sources.get(c, ()) for c in callees))
    _sources[compiled] = files
    stats = [Path(file).stat() for file in sorted(files)]
    compiled._cache._cache_file._source_stamp = tuple((s.st_mtime, s.st_size) for s in stats)
