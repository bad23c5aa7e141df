"""Decorators for compiled functions, with a cache that notices every edit.

numba looks only at the file a function stands in to decide whether its cached machine code is still
good, but the code holds the functions it calls from other files too: after an edit there, it
would silently run the old ones. Here all modules of the solver are the stamp.

Every operation is rounded by itself, in the order in which it is written. Which products and sums
a compiler would contract into one rounding depends on what it has inlined, and that on what was
compiled before and what came from the cache: a chaotic motion would then differ from one fresh
installation to the next. Without that freedom the same code gives the same bytes.

What only compiled code calls is not made into machine code by itself (`_Within`), only as a part of
the entries. numba would also optimise and make each function alone, which took half of the
compilation; the motions are the same to the last bit, and take the same time.

`fused` asks for one rounding of a product and a sum, and is the same operation everywhere:
shorter by one rounding, and by a third of the time of a polynomial.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

from numba import njit, typeof, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.extending import intrinsic

from vinesexp.environment import keep_caches_writable
from vinesexp.whole_files import alone

keep_caches_writable()  # numba asks for its folder when a function is marked

F = TypeVar("F", bound=Callable[..., Any])


def _stamp() -> str:
    """Digest of the text of every module here: a file that is touched or copied keeps it."""
    texts = (path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
    return sha256(b"\0".join(texts)).hexdigest()


_STAMP = _stamp()


def _jit(function: Callable[..., Any], **options: Any) -> Any:
    make: Any = njit
    dispatcher = make(
        cache=True,
        nogil=True,
        error_model="numpy",
        no_cfunc_wrapper=True,
        **options,
    )(function)
    if hasattr(dispatcher, "get_call_template"):  # not where numba is told not to compile
        dispatcher.get_call_template = _of_any_number(dispatcher.get_call_template)
    cache_file: Any = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if hasattr(cache_file, "_source_stamp"):
        cache_file._source_stamp = _STAMP
    return dispatcher


class _Unfinished(JITCodeLibrary):
    """Code that is optimised, and made into machine code, in what it becomes a part of."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        library: Any = self
        library._finalize_dynamic_globals()
        self._finalized = True

    def serialize_using_object_code(self) -> Any:
        library: Any = self
        return library.serialize_using_bitcode()

    @property
    def codegen(self) -> _Unfinished:
        return self

    def set_env(self, *_: object) -> None:
        """What a function would need to raise errors of Python is given to machine code."""


class _Within(Compiler):
    """Compiler of functions that only compiled code calls."""

    def define_pipelines(self) -> Any:
        state, library, default = self.state, cast(Any, _Unfinished), cast(Any, super())
        state.library = library(state.targetctx.codegen(), state.func_id.func_qualname)
        return default.define_pipelines()


_PART = {"no_cpython_wrapper": True, "_nrt": False, "pipeline_class": _Within}


def _of_any_number(template_for: Callable[..., Any]) -> Callable[..., Any]:
    """Have a function that is called with 0, 1 or 2 compiled once, not for each of these numbers.

    That takes a fifth off the compilation of all; the motions are the same to the last bit.
    """

    def of(arguments: Sequence[Any], named: Mapping[str, Any]) -> Any:
        whole: Callable[[Any], Any] = types.unliteral
        return template_for(
            tuple(map(whole, arguments)), {name: whole(kind) for name, kind in named.items()}
        )

    return of


def compiled(function: F) -> F:
    """Compile on first use, keep the machine code on disk; to be called by compiled code only.

    The code is part of whatever calls it. A call would hand over every array as seven numbers or
    nine, which took a third of the time of an impact.

    What only Python would need to call it is not made: that is a tenth of the compilation. Division
    by zero gives inf or nan, as in numpy: a check at every division costs more than the division.
    Nothing is allocated, so that arrays need no counting of their references, which took 40 % of
    the time of the event loop; what scratch space there is comes from the `entry`.
    """
    return cast("F", _jit(function, forceinline=True, **_PART))


def apart(function: F) -> F:
    """`compiled`, but called: what is long and called from several places, or seldom."""
    return cast("F", _jit(function, **_PART))


def entry(function: F) -> F:
    """`compiled`, for the functions that Python calls: one process compiles, the others wait.

    Several jobs of a first run would otherwise each compile the same code, side by side. The first
    call asks for the machine code under a lock on the cache's folder, and whoever comes second
    finds it on disk. Who finds it there at once does not wait while others are compiled.
    """
    dispatcher, type_of = _jit(function, _nrt=False), cast("Callable[[Any], Any]", typeof)

    compiled_for: set[tuple[type, ...]] = set()

    @wraps(function)
    def call(*arguments: Any) -> Any:
        kinds = tuple(map(type, arguments))
        if kinds not in compiled_for:
            wanted, folder = tuple(map(type_of, arguments)), dispatcher.stats.cache_path
            waits = folder and not _on_disk(dispatcher, wanted)
            with alone(Path(folder) / "vinesexp.lock" if waits else None):
                dispatcher.compile(wanted)
            compiled_for.add(kinds)
        return dispatcher(*arguments)

    return cast("F", call)


def _on_disk(dispatcher: Any, kinds: tuple[Any, ...]) -> bool:
    """Whether there is machine code of a function for arguments of some kinds."""
    key = dispatcher._cache._index_key(kinds, dispatcher.targetctx.codegen())
    return key in dispatcher._cache._cache_file._load_index()


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
