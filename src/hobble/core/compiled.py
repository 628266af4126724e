"""numba's `njit` with a disk cache that may fail.

numba stores compiled functions next to the package, or in the user's home if it cannot write there. If it can
write to neither, it raises an error at import. If the disk is full or a cached file is damaged, it raises an
error at the first call. In these cases the `njit` of this module only warns, once in a process. Each process
then compiles the functions again.
"""

import functools
import warnings
from collections.abc import Callable
from typing import Any

import numba

CACHE_HINT = "Set NUMBA_CACHE_DIR to a folder that can be written."


def njit(function: Callable | None = None, **options: Any) -> Any:
    """The decorator `numba.njit(cache=True)`. A cache that fails only gives a warning.

    Written as `@njit`, or as `@njit(...)` with options of `numba.njit`.
    """
    if function is None:
        return lambda decorated: njit(decorated, **options)
    use_cache = options.pop("cache", True)
    dispatcher = numba.njit(**options)(function)
    if use_cache:
        try:
            dispatcher.enable_caching()
        except (RuntimeError, OSError) as error:  # numba found no folder that it may write to
            _warn(error)
        else:
            for method in ("load_overload", "save_overload"):
                setattr(dispatcher._cache, method, _forgiving(getattr(dispatcher._cache, method)))
    return dispatcher


def _forgiving(method: Callable) -> Callable:
    """A method of numba's cache that warns and returns None, as for an unknown function, if it fails.

    numba unpickles files, and a damaged one can raise anything.
    """

    def call(*arguments: Any) -> Any:
        try:
            return method(*arguments)
        except Exception as error:
            _warn(error)
            return None

    return call


@functools.cache
def _warn_once(text: str) -> None:
    """Give a warning. Its cache tells `_warn` whether this function was called before."""
    warnings.warn(text, RuntimeWarning, stacklevel=4)


def _warn(error: Exception) -> None:
    """Warn that the cache failed, at most once in a process."""
    if _warn_once.cache_info().currsize == 0:
        reason = f"{type(error).__name__}: {error}"
        _warn_once(f"compiled functions are not kept for the next start ({reason}). {CACHE_HINT}")
