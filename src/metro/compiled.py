"""Functions on numbers and arrays that are compiled to machine code, where loops in Python take too long."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import config, njit

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile a function that makes no arrays, but may write to those it is given.

    Numba then need not count who still uses an array, which takes ten times as long as the few sums that such
    a function does (``docs/performance.md``).
    """
    return _compiled(function, _nrt=False)


def compiled_with_arrays(function: Function) -> Function:
    """Compile a function that makes arrays."""
    return _compiled(function)


def _compiled(function: Function, **options: bool) -> Function:
    """Compile a function with numba when it is first called, and keep the result on disk.

    Divisions by zero give infinity, as in numpy. A compiled function calls only compiled ones of its own
    folder: what is kept belongs to the sources there as they are. Where neither the folder of the package nor
    a cache of the user can be written, each process compiles anew.
    """
    config.CACHE_DIR = _cache(Path(function.__code__.co_filename).parent)
    try:
        made = njit(function, error_model="numpy", forceinline=True, cache=True, **options)
    except RuntimeError:
        made = njit(function, error_model="numpy", forceinline=True, **options)
    return cast(Function, made)


@lru_cache
def _cache(folder: Path) -> str:
    """Return where what is compiled of a folder is kept, and remove what was of older sources.

    Numba itself sees that the file of a function has changed, but not that of a function that it calls.
    """
    sources = (each.read_bytes() for each in [Path(__file__), *sorted(folder.glob("*.py"))])
    kept = folder / "__pycache__" / f"compiled-{hashlib.sha256(b''.join(sources)).hexdigest()[:16]}"
    try:
        for old in kept.parent.glob("compiled-*"):
            if old != kept:
                shutil.rmtree(old, ignore_errors=True)
        kept.mkdir(parents=True, exist_ok=True)
    except OSError:
        return ""  # numba's own choice: a cache of the user
    return str(kept)
