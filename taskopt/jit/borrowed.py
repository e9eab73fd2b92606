"""Arrays whose references compiled code does not count.

Each view that compiled code makes of an array counts one reference more to its memory, and one less when the
view is done with. Since another thread may hold the same array, both are atomic operations, which cost as
much as tens of floating-point operations. A tick makes dozens of views, and their counts took up to half of
its time. They are needless there: whoever calls a kernel holds the arrays until it returns.

Arrays that stay the same from call to call can be borrowed through an `ArrayTable`: passing one number to a
kernel costs a tenth of passing ten arrays.
"""

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from llvmlite.ir import IntType, IRBuilder, Value
from numba.core import types
from numba.core.base import BaseContext
from numba.core.cgutils import get_null_value
from numba.core.typing.templates import Signature
from numba.extending import lower_builtin, type_callable
from numba.np.arrayobj import make_array, populate_array

from taskopt.arrays import Array, IntArray, StateArray
from taskopt.jit import COMPILED

T = TypeVar("T")


def borrowed(array: T) -> T:
    """Return a view of an array whose references compiled code does not count.

    The view, and every view made of it, must not be used after the kernel that Python called has returned.

    Args:
        array: An array that the caller of the kernel holds.

    Returns:
        The same memory; in plain Python the array itself.
    """
    return array


@type_callable(borrowed)
def _typed(_: object) -> Callable[[types.Array], types.Array]:
    """Tell Numba that the type of a borrowed array is that of the array."""

    def type_of_borrowed(array: types.Array) -> types.Array:
        """Return the type of the result."""
        return array

    return type_of_borrowed


@lower_builtin(borrowed, types.Array)
def _compiled(
    context: BaseContext, builder: IRBuilder, signature: Signature, arguments: tuple[Value]
) -> Value:
    """Write the machine code: copy pointer, shape and strides, and set the owner of the memory to null."""
    view = make_array(signature.args[0])(context, builder, arguments[0])
    view.meminfo, view.parent = get_null_value(view.meminfo.type), get_null_value(view.parent.type)
    return view._getvalue()


class ArrayTable:
    """Arrays that kernels reach by their number in the table, as flat views.

    Args:
        arrays: Contiguous arrays, which the table keeps alive.

    Attributes:
        handle: What is passed to a kernel: an address, or the flat arrays themselves where compilation is
            disabled.
    """

    def __init__(self, *arrays: Array | IntArray | StateArray) -> None:
        self._arrays = tuple(array.ravel(order="K") for array in arrays)
        for flat, array in zip(self._arrays, arrays, strict=True):
            if not np.may_share_memory(flat, array) and array.size:
                raise ValueError("a table of arrays takes only contiguous ones")
        places = [(flat.ctypes.data, flat.size) for flat in self._arrays]
        self._places = np.array(places, dtype=np.int64)
        self.handle = self._places.ctypes.data if COMPILED else self._arrays


def floats_in(table: tuple[Array, ...], k: int) -> Array:
    """Return an array of floats from a table.

    Args:
        table: The handle of an `ArrayTable`.
        k: Number of the array.

    Returns:
        Flat view, which must not be used after the kernel that Python called has returned.
    """
    return table[k]


def integers_in(table: tuple[IntArray, ...], k: int) -> IntArray:
    """Return an array of integers from a table.

    Args:
        table: As of `floats_in`.
        k: As of `floats_in`.

    Returns:
        As of `floats_in`.
    """
    return table[k]


def states_in(table: tuple[StateArray, ...], k: int) -> StateArray:
    """Return an array of small integers from a table, such as an active set.

    Args:
        table: As of `floats_in`.
        k: As of `floats_in`.

    Returns:
        As of `floats_in`.
    """
    return table[k]


def _compile_look_up(look_up: Callable[..., object], kind: types.Type) -> None:
    """Tell Numba the type and the machine code of a function such as `floats_in`."""

    @type_callable(look_up)
    def typed(_: object) -> Callable[[types.Type, types.Type], types.Array]:
        def type_of_array(table: types.Type, k: types.Type) -> types.Array:  # noqa: ARG001 (names count)
            return types.Array(kind, 1, "C")

        return type_of_array

    @lower_builtin(look_up, types.Integer, types.Integer)
    def compiled(
        context: BaseContext, builder: IRBuilder, signature: Signature, arguments: tuple[Value, Value]
    ) -> Value:
        word = IntType(64)
        row = builder.mul(arguments[1], word(2))
        places = builder.inttoptr(arguments[0], word.as_pointer())
        address, size = (builder.load(builder.gep(places, [builder.add(row, word(i))])) for i in range(2))
        view = make_array(signature.return_type)(context, builder)
        step = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(kind)))
        data = builder.inttoptr(address, view.data.type)
        populate_array(view, data, shape=[size], strides=[step], itemsize=step, meminfo=None)
        return view._getvalue()


_compile_look_up(floats_in, types.float64)
_compile_look_up(integers_in, types.int64)
_compile_look_up(states_in, types.int8)
