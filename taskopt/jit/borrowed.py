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
from numba.extending import intrinsic, overload
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


@intrinsic
def _without_owner(
    _: object, array: types.Array
) -> tuple[Signature, Callable[[BaseContext, IRBuilder, Signature, tuple[Value]], Value]]:
    """Describe to Numba a function that returns its array with no owner of the memory."""

    def generate(context: BaseContext, builder: IRBuilder, _: Signature, arguments: tuple[Value]) -> Value:
        """Copy pointer, shape and strides, and set the owner to null."""
        view = make_array(array)(context, builder, arguments[0])
        view.meminfo, view.parent = get_null_value(view.meminfo.type), get_null_value(view.parent.type)
        return view._getvalue()

    return array(array), generate


@overload(borrowed)
def _compiled(array: types.Array) -> Callable[[types.Array], types.Array]:  # noqa: ARG001 (a name that Numba needs)
    """Return the body of `borrowed` in compiled code."""

    def body(array: types.Array) -> types.Array:
        """Take the owner away."""
        return _without_owner(array)  # pyright: ignore[reportCallIssue]

    return body
