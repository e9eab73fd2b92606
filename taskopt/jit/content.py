"""The content of a kernel: its own code, and every constant that the code reads.

Two kernels with equal content compile to equal machine code, wherever their files lie. Comments,
docstrings and line numbers do not belong to the content. Constants do: numbers, strings, arrays,
tuples, enumerations and the fields of named tuples, read from the globals of the module, from other
modules (`tolerances.SIGN`) or from a closure.
"""

import hashlib
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import Enum
from types import CodeType, FunctionType, ModuleType

import numpy as np

from taskopt.errors import InvalidValue

# A function or class of these packages is known by its name; their versions are part of every key.
_VERSIONED = frozenset(sys.stdlib_module_names) | {"numpy", "numba", "llvmlite"}
_PLAIN = (bool, int, float, complex, str, bytes, type(None), type(Ellipsis), slice)


@dataclass
class Content:
    """The content of one kernel.

    Attributes:
        callees: The compiled kernels that the code calls, in the order in which they were found.
        text: A description of code and constants; equal texts mean equal content. A callee appears
            in it by name only.
    """

    callees: list[object] = field(default_factory=list)
    text: str = ""


class Reader:
    """Reads the content of functions.

    Args:
        is_kernel: Tells a compiled kernel, which is a callee, from any other value.
    """

    def __init__(self, is_kernel: Callable[[object], bool]) -> None:
        self._is_kernel = is_kernel

    def read(self, function: FunctionType) -> Content:
        """Return the content of a function.

        Raises:
            InvalidValue: The function reads a value whose content cannot be told.
        """
        content = Content()
        content.text = self._function(function, content, frozenset())
        return content

    def _function(self, function: FunctionType, content: Content, above: frozenset[FunctionType]) -> str:
        """Describe code, defaults, closure and the globals that the code names."""
        name = _name(function)
        if function in above:  # a recursive function
            return name
        above = above | {function}
        names = frozenset(_names(function.__code__))
        cells = [cell.cell_contents for cell in function.__closure__ or ()]
        read = [(key, function.__globals__[key]) for key in sorted(names & function.__globals__.keys())]
        outside = [*read, *zip(function.__code__.co_freevars, cells, strict=True)]
        outside.append(("defaults", (function.__defaults__, function.__kwdefaults__)))
        try:
            described = [f"{key}={self._value(value, names, content, above)}" for key, value in outside]
        except InvalidValue as error:
            raise InvalidValue(f"the kernel {name} cannot be compiled: {error}") from None
        return "\n".join([name, _code(function.__code__, function.__doc__), *described])

    def _value(
        self, value: object, names: frozenset[str], content: Content, above: frozenset[FunctionType]
    ) -> str:
        """Describe one value that a function reads."""
        if self._is_kernel(value):
            content.callees.append(value)
            return f"kernel {_name(value)}"
        if isinstance(value, Enum):
            return f"{_name(type(value))}.{value.name} {value.value!r}"
        if isinstance(value, np.ndarray | np.generic):
            digest = hashlib.sha256(np.asarray(value).tobytes()).hexdigest()
            return f"{value.dtype.str} {value.shape} {value.strides} {digest}"
        if isinstance(value, tuple | list | set | frozenset):
            parts = [self._value(part, names, content, above) for part in value]
            parts = sorted(parts) if isinstance(value, set | frozenset) else parts
            return f"{_name(type(value))} {getattr(value, '_fields', '')} [{', '.join(parts)}]"
        if isinstance(value, dict):
            return f"dict {self._value(list(value.items()), names, content, above)}"
        if isinstance(value, _PLAIN):
            return f"{type(value).__name__} {value!r}"
        if isinstance(value, ModuleType):
            inside = [] if _versioned(value.__name__) else sorted(names & vars(value).keys())
            described = [f"{key}={self._value(vars(value)[key], names, content, above)}" for key in inside]
            return f"module {value.__name__} [{', '.join(described)}]"
        if isinstance(value, FunctionType) and not _versioned(value.__module__):
            return self._function(value, content, above)
        wrapped = vars(value).get("__wrapped__") if hasattr(value, "__dict__") else None
        if isinstance(wrapped, FunctionType) and not _versioned(wrapped.__module__):  # of Numba
            options = getattr(value, "targetoptions", "")
            return f"{_name(type(value))} {options} {self._function(wrapped, content, above)}"
        return _named(value)


def _named(value: object) -> str:
    """Describe a class, a builtin function, a NumPy dtype or a Numba type by its name."""
    if isinstance(value, type) and issubclass(value, Enum):
        return f"{_name(value)} {[(key, member.value) for key, member in value.__members__.items()]}"
    if isinstance(value, type) and issubclass(value, tuple):
        return f"{_name(value)} {getattr(value, '_fields', ())} {getattr(value, '_field_defaults', {})}"
    if _versioned(type(value).__module__) and not hasattr(value, "__qualname__"):
        return f"{_name(type(value))} {value}"  # a dtype, a ufunc, a type of Numba
    if hasattr(value, "__qualname__") and _versioned(value.__module__):
        return _name(value)
    raise InvalidValue(
        f"it reads a value of type {_name(type(value))}, and a change of that value could not be noticed; "
        "use numbers, strings, arrays, tuples, enumerations, functions and modules"
    )


def _versioned(module: str | None) -> bool:
    """Return True for a module whose content follows from the versions in the key."""
    return (module or "builtins").partition(".")[0] in _VERSIONED


def _name(value: object) -> str:
    """Return the module and the qualified name of a function, class or kernel."""
    return f"{getattr(value, '__module__', '')}.{getattr(value, '__qualname__', '')}"


def _names(code: CodeType) -> Iterator[str]:
    """Yield the globals and attributes that code names, nested functions included."""
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _names(constant)


def _code(code: CodeType, doc: str | None = None) -> str:
    """Describe code without file, line numbers and docstring."""
    constants = list(code.co_consts)
    if constants and constants[0] == doc:
        constants[0] = None
    described = [
        _code(constant) if isinstance(constant, CodeType) else f"{type(constant).__name__} {constant!r}"
        for constant in constants
    ]
    arguments = code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags
    variables = code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars
    return f"{code.co_code.hex()} {arguments} {variables} {described}"
