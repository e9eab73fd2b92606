"""Arrays whose references compiled code does not count.

Each view that compiled code makes of an array counts one reference more to its memory, and one less when the
view is done with. Since another thread may hold the same array, both are atomic operations, which cost as
much as tens of floating-point operations. A tick makes dozens of views, and their counts took up to half of
its time. They are needless there: whoever calls a kernel holds the arrays until it returns.
"""

from collections.abc import Callable
from typing import TypeVar

from llvmlite.ir import IRBuilder, Value
from numba.core import types
from numba.core.base import BaseContext
from numba.core.cgutils import get_null_value
from numba.core.typing.templates import Signature
from numba.extending import lower_builtin, type_callable
from numba.np.arrayobj import make_array

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
