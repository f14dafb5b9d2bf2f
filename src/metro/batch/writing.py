"""Files that are there whole or not at all; and what the file system refuses, in words."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from metro.batch.findings import ContractError, Finding

_FULL = "make room on this disk, then call metro run again: what is finished is kept"
_FORBIDDEN = "make the folder writable, or work in another one (snakemake --directory)"
_IN_THE_WAY = "something else has its name or that of a folder above it: move it away"
REMEDIES = {
    errno.ENOSPC: _FULL,
    errno.EDQUOT: _FULL,
    errno.EFBIG: "larger than this process may write: raise the limit (ulimit -f)",
    errno.EROFS: _FORBIDDEN,
    errno.EACCES: _FORBIDDEN,
    errno.EPERM: _FORBIDDEN,
    errno.EEXIST: _IN_THE_WAY,
    errno.ENOTDIR: _IN_THE_WAY,
    errno.EISDIR: _IN_THE_WAY,
}


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn an error of the file system while ``path`` is written into one line that names the remedy.

    Errors about other files, such as those that are read meanwhile, are left as they are.

    Raises
    ------
    ContractError
        The disk is full, read-only, or something is in the way.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in REMEDIES or not _is_about(path, error):
            raise
        message = f"cannot be written: {error.strerror}; {REMEDIES[error.errno]}"
        raise ContractError([Finding("error", str(path), message)]) from None


def write_atomically(path: Path, write: Callable[[IO[bytes]], object]) -> None:
    """Write ``path`` through a unique temporary file beside it, so that it is there whole or not at all."""
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        try:
            with os.fdopen(handle, "wb") as stream:
                write(stream)
                stream.flush()
                os.fsync(stream.fileno())
            Path(temporary).chmod(0o644)
            Path(temporary).replace(path)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise


def _is_about(path: Path, error: OSError) -> bool:
    """Return whether an error names a file where ``path`` is to be, or none: a stream has no file name."""
    if error.filename is None:
        return True
    named, path = Path(os.fsdecode(error.filename)).absolute(), path.absolute()
    return named in (path, *path.parents) or path.parent in named.parents
