"""Prefetch memory some time before it is read or written: this affects time only."""

from __future__ import annotations

from typing import Any

import numba
from numba.core import cgutils, types
from numba.extending import intrinsic

_settings: Any = vars(numba)["config"]
_ir: Any = vars(cgutils)["ir"]
FOR_WRITING, KEPT, DATA = 1, 3, 1  # arguments of LLVM's llvm.prefetch: for writing, keep in all caches, data


def _prefetch(typing: Any, array: Any, place: Any) -> Any:
    """Prefetch the cache line that contains the byte ``place`` of a contiguous array, for writing."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        number = _ir.IntType(32)
        kind = _ir.FunctionType(_ir.VoidType(), [cgutils.voidptr_t, number, number, number])
        fetch = builder.module.declare_intrinsic("llvm.prefetch", [cgutils.voidptr_t], kind)
        line = builder.gep(builder.bitcast(data, cgutils.voidptr_t), [arguments[1]])
        builder.call(fetch, [line, number(FOR_WRITING), number(KEPT), number(DATA)])
        return context.get_dummy_value()

    return types.void(array, types.int64), generate


def _nothing(array: Any, place: int) -> None:
    """The same for kernels that run as plain Python: does nothing."""


prefetch: Any = _nothing if _settings.DISABLE_JIT else intrinsic(_prefetch)
