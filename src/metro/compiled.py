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
    """Compile a function with numba when it is first called, and keep the result on disk.

    Divisions by zero give infinity, as in numpy. A compiled function calls only compiled ones of its own
    folder: what is kept belongs to the sources there as they are. Where neither the folder of the package nor
    a cache of the user can be written, each process compiles anew.
    """
    options = {"error_model": "numpy", "forceinline": True}
    config.CACHE_DIR = _cache(Path(function.__code__.co_filename).parent)
    try:
        return cast(Function, njit(function, cache=True, **options))
    except RuntimeError:
        return cast(Function, njit(function, **options))


@lru_cache
def _cache(folder: Path) -> str:
    """Return where what is compiled of a folder is kept, and remove what was of older sources.

    Numba itself sees that the file of a function has changed, but not that of a function that it calls.
    """
    stamp = hashlib.sha256(b"".join(each.read_bytes() for each in sorted(folder.glob("*.py")))).hexdigest()
    kept = folder / "__pycache__" / f"compiled-{stamp[:16]}"
    try:
        for old in kept.parent.glob("compiled-*"):
            if old != kept:
                shutil.rmtree(old, ignore_errors=True)
        kept.mkdir(parents=True, exist_ok=True)
    except OSError:
        return ""  # numba's own choice: a cache of the user
    return str(kept)
