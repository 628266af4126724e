"""numba's `njit` with a cache on disk that can fail without harm.

numba writes compiled functions beside the package, or under the user's home where that cannot be written.
Where neither can be written it raises at import. Where the disk is full or a cached file is damaged it raises
at the first call. Here each of these costs one warning and the seconds of compiling again.
"""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from typing import Any

import numba

FIX = "Set NUMBA_CACHE_DIR to a folder that can be written."


def njit(function: Callable | None = None, **options: Any) -> Any:
    """Like `numba.njit(cache=True)`, with or without options, but for what happens where the cache fails."""
    if function is None:
        return lambda later: njit(later, **options)
    caches = options.pop("cache", True)
    dispatcher = numba.njit(**options)(function)
    if caches:
        try:
            dispatcher.enable_caching()
        except (RuntimeError, OSError) as error:  # numba found no folder that it may write
            _warn(error)
        else:
            dispatcher._cache = ForgivingCache(dispatcher._cache)
    return dispatcher


class ForgivingCache:
    """A numba cache whose failures count as a miss; all else is passed on."""

    def __init__(self, cache: Any) -> None:
        self._cache = cache

    def __getattr__(self, name: str) -> Any:
        return getattr(self._cache, name)

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """The compiled function, or None where there is none or it cannot be read."""
        try:
            return self._cache.load_overload(signature, target_context)
        except Exception as error:  # a damaged file can raise anything: it is unpickled
            _warn(error)
            return None

    def save_overload(self, signature: Any, data: Any) -> None:
        """Keep the compiled function, if the disk lets us."""
        try:
            self._cache.save_overload(signature, data)
        except Exception as error:  # reading the index of the cache comes first, and it may be damaged
            _warn(error)


@functools.cache
def _once(text: str) -> None:
    warnings.warn(text, RuntimeWarning, stacklevel=4)


def _warn(error: Exception) -> None:
    """One warning in a process, whatever fails and however often."""
    if _once.cache_info().currsize == 0:
        _once(f"compiled functions are not kept for the next start ({type(error).__name__}: {error}). {FIX}")
