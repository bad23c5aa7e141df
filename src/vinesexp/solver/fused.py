"""One rounding for a product and a sum, where it is asked for.

`compiled.py` says why the compiler may not choose this by itself. Asked for in so many words it is
the same operation everywhere: shorter by one rounding, and by a third of the time of a polynomial.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from numba import types
from numba.extending import intrinsic

if TYPE_CHECKING:

    def fused(a: float, b: float, c: float) -> float:
        """a b + c with one rounding."""
        raise NotImplementedError

    def wide() -> None:
        """Let the loops of the function that calls this fill the widest vectors there are."""

else:

    @intrinsic
    def fused(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
        """a b + c with one rounding, to be called by compiled code only."""

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.fma(*arguments)

        number = types.float64
        return number(number, number, number), generate

    @intrinsic
    def wide(typing_context: Any) -> Any:
        """Let the loops of the function that calls this fill the widest vectors there are.

        By itself LLVM takes half of an AVX-512 register: wide vectors slow the clock of some
        processors, which pays only in loops that are long.
        """

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            # llvmlite lets by name only what it knows
            set.add(builder.function.attributes, '"prefer-vector-width"="512"')
            return context.get_dummy_value()

        return types.none(), generate
