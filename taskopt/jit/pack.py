"""Packs: the same number of eight arms, which one machine instruction changes together.

A kernel that resolves eight arms in lock-step is written as one for a single arm, with packs in place of
floats. Compiled, a pack is a vector of LLVM; in plain Python it is a NumPy array of shape (8,), for which the
functions below are what they say. Arrays of packs are arrays of floats, (k, 8), row by row in memory.

Operations are those of `+`, `-`, `*`, `/` with packs and floats. A product may be fused with the sum that
takes it, which only saves a rounding; nothing is reordered, since the reduction of an angle by multiples of
π/2 depends on the order. A comparison with NaN is false.
"""

import operator
from collections.abc import Callable
from typing import cast

import numpy as np
from llvmlite import ir
from llvmlite.ir import IRBuilder, Value
from numba.core import types
from numba.core.base import BaseContext
from numba.core.cgutils import get_or_insert_function
from numba.core.datamodel import models
from numba.core.typing.templates import Signature
from numba.extending import lower_builtin, register_model, type_callable
from numba.np.arrayobj import make_array

from taskopt.arrays import Array

PACK = 8  # arms in a pack
Numbers = Array | float  # a pack, or a number that is the same for all arms


def load(array: Array, i: int) -> Array:
    """Return the i-th pack of an array.

    Args:
        array: Packs, (k, 8).
        i: Index, not negative.

    Returns:
        The pack.
    """
    return array[i].copy()


def store(array: Array, i: int, value: Array) -> None:
    """Write the i-th pack of an array.

    Args:
        array: Packs, (k, 8).
        i: Index, not negative.
        value: The pack.
    """
    array[i] = value


def spread(value: float) -> Array:
    """Return a pack of equal numbers.

    Args:
        value: The number.

    Returns:
        The pack.
    """
    return np.full(PACK, value)


def where_less(a: Numbers, b: Numbers, then: Numbers, other: Numbers) -> Array:
    """Return `then` where a < b, else `other`.

    Args:
        a: Pack or number.
        b: Pack or number.
        then: Pack or number.
        other: Pack or number; one of the four at least is a pack.

    Returns:
        The pack.
    """
    return np.where(np.less(a, b), then, other)


def any_less(a: Numbers, b: Numbers) -> bool:
    """Return True if a < b for any arm.

    Args:
        a: Pack.
        b: Pack.

    Returns:
        True if there is such an arm.
    """
    return bool(np.less(a, b).any())


def root(a: Array) -> Array:
    """Return the square roots.

    Args:
        a: Pack.

    Returns:
        The pack; NaN for a negative number.
    """
    return np.sqrt(a)


def size(a: Array) -> Array:
    """Return the magnitudes.

    Args:
        a: Pack.

    Returns:
        The pack.
    """
    return np.abs(a)


def nearest(a: Array) -> Array:
    """Return the nearest integers, ties to even.

    Args:
        a: Pack.

    Returns:
        The pack.
    """
    return np.rint(a)


class PackType(types.Type):
    """Type of a pack in compiled code."""

    def __init__(self) -> None:
        super().__init__(name="Pack")


_PACK = PackType()
_FLOATS = ir.VectorType(ir.DoubleType(), PACK)
_FUSED = ("contract",)


@register_model(PackType)
class _PackModel(models.PrimitiveModel):
    """Memory of a pack: a vector of LLVM."""

    def __init__(self, manager: object, of: types.Type) -> None:
        super().__init__(manager, of, _FLOATS)


def _of_packs(*given: types.Type) -> bool:
    """Return True if arguments are packs or floats, and one of them at least a pack."""
    return _PACK in given and all(isinstance(one, PackType | types.Float) for one in given)


def _takes_one(function: Callable[..., object]) -> None:
    """Tell Numba that a function of one pack returns a pack."""

    @type_callable(function)
    def _typed(_: object) -> Callable[[types.Type], types.Type | None]:
        return lambda a: _PACK if _of_packs(a) else None


def _takes_two(function: Callable[..., object], result: types.Type) -> None:
    """Tell Numba the type of the result of a function of two packs."""

    @type_callable(function)
    def _typed(_: object) -> Callable[[types.Type, types.Type], types.Type | None]:
        return lambda a, b: result if _of_packs(a, b) else None


def _splat(builder: IRBuilder, number: Value) -> Value:
    """Return the vector of eight equal numbers."""
    first = builder.insert_element(ir.Constant(_FLOATS, ir.Undefined), number, ir.IntType(32)(0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), PACK), [0] * PACK)
    return builder.shuffle_vector(first, ir.Constant(_FLOATS, ir.Undefined), zeros)


def _as_vectors(
    context: BaseContext, builder: IRBuilder, signature: Signature, arguments: tuple[Value, ...]
) -> list[Value]:
    """Return the arguments of an operation as vectors, with numbers spread."""
    return [
        value if kind is _PACK else _splat(builder, context.cast(builder, value, kind, types.float64))
        for kind, value in zip(signature.args, arguments, strict=True)
    ]


def _arithmetic(operation: Callable[..., object], name: str) -> None:
    """Define a binary operation of packs, and of packs with numbers."""

    def lowered(
        context: BaseContext, builder: IRBuilder, signature: Signature, arguments: tuple[Value, ...]
    ) -> Value:
        return getattr(builder, name)(*_as_vectors(context, builder, signature, arguments), flags=_FUSED)

    _takes_two(operation, _PACK)
    for pair in ((PackType, PackType), (PackType, types.Float), (types.Float, PackType)):
        lower_builtin(operation, *pair)(lowered)


for _operation, _name in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _arithmetic(_operation, _name)


def _by_intrinsic(function: Callable[..., object], name: str) -> None:
    """Define a function of one pack by an intrinsic of LLVM."""
    _takes_one(function)

    @lower_builtin(function, PackType)
    def _lowered(_: BaseContext, builder: IRBuilder, __: Signature, arguments: tuple[Value]) -> Value:
        of = ir.FunctionType(_FLOATS, [_FLOATS])
        return builder.call(get_or_insert_function(builder.module, of, f"{name}.v{PACK}f64"), arguments)


_by_intrinsic(root, "llvm.sqrt")
_by_intrinsic(size, "llvm.fabs")
_by_intrinsic(nearest, "llvm.rint")


_takes_one(operator.neg)


@lower_builtin(operator.neg, PackType)
def _negative(_: BaseContext, builder: IRBuilder, __: Signature, arguments: tuple[Value]) -> Value:
    return cast("Value", builder.fneg(arguments[0]))


@type_callable(spread)
def _typed_spread(_: object) -> Callable[[types.Type], types.Type | None]:
    return lambda value: _PACK if isinstance(value, types.Float) else None


@lower_builtin(spread, types.Float)
def _spread(context: BaseContext, builder: IRBuilder, signature: Signature, arguments: tuple[Value]) -> Value:
    return _as_vectors(context, builder, signature, arguments)[0]


@type_callable(where_less)
def _typed_where_less(
    _: object,
) -> Callable[[types.Type, types.Type, types.Type, types.Type], types.Type | None]:
    return lambda a, b, then, other: _PACK if _of_packs(a, b, then, other) else None


@lower_builtin(where_less, types.Any, types.Any, types.Any, types.Any)
def _where_less(
    context: BaseContext, builder: IRBuilder, signature: Signature, arguments: tuple[Value, ...]
) -> Value:
    a, b, then, other = _as_vectors(context, builder, signature, arguments)
    return builder.select(builder.fcmp_ordered("<", a, b), then, other)


_takes_two(any_less, types.boolean)


@lower_builtin(any_less, types.Any, types.Any)
def _any_less(
    context: BaseContext, builder: IRBuilder, signature: Signature, arguments: tuple[Value, ...]
) -> Value:
    a, b = _as_vectors(context, builder, signature, arguments)
    found = builder.fcmp_ordered("<", a, b)
    bits = builder.bitcast(found, ir.IntType(PACK))
    return cast("Value", builder.icmp_unsigned("!=", bits, ir.IntType(PACK)(0)))


def _address(
    context: BaseContext, builder: IRBuilder, signature: Signature, arguments: tuple[Value, ...]
) -> Value:
    """Return the address of a pack in an array."""
    array = make_array(signature.args[0])(context, builder, arguments[0])
    index = context.cast(builder, arguments[1], signature.args[1], types.intp)
    first = builder.gep(array.data, [builder.mul(index, context.get_constant(types.intp, PACK))])
    return cast("Value", builder.bitcast(first, ir.PointerType(_FLOATS)))


def _is_packs(array: types.Type) -> bool:
    """Return True for the type of an array of packs."""
    return (
        isinstance(array, types.Array)
        and array.ndim == 2
        and array.layout == "C"
        and array.dtype == types.float64
    )


@type_callable(load)
def _typed_load(_: object) -> Callable[..., types.Type | None]:
    def of(array: types.Type, i: types.Type) -> types.Type | None:
        return _PACK if _is_packs(array) and isinstance(i, types.Integer) else None

    return of


@lower_builtin(load, types.Array, types.Integer)
def _load(
    context: BaseContext, builder: IRBuilder, signature: Signature, arguments: tuple[Value, ...]
) -> Value:
    return builder.load(_address(context, builder, signature, arguments), align=8)


@type_callable(store)
def _typed_store(_: object) -> Callable[..., types.Type | None]:
    def of(array: types.Type, i: types.Type, value: types.Type) -> types.Type | None:
        return types.none if _is_packs(array) and isinstance(i, types.Integer) and value is _PACK else None

    return of


@lower_builtin(store, types.Array, types.Integer, PackType)
def _store(
    context: BaseContext, builder: IRBuilder, signature: Signature, arguments: tuple[Value, ...]
) -> Value:
    builder.store(arguments[2], _address(context, builder, signature, arguments), align=8)
    return context.get_dummy_value()
