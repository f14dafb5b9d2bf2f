"""When a file is complete: it has not changed for a while, and nobody on this machine has it open to write.

A copy over a network may pause, and some programs give a file its full size before they fill it. No waiting
time is safe against all of that. So a file must also be readable, and one that is not is given
:data:`PATIENCE_S` before that is said.
"""

from __future__ import annotations

import errno
import fcntl
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

POLL_S = 0.25
# Programs write at least once in some tenths of a second while they copy; two polls more leave a judgement
# well within three seconds of the last byte.
QUIET_S = 0.75
PATIENCE_S = 5.0


class Stamp(NamedTuple):
    """What changes when a file does."""

    inode: int
    size: int
    changed_ns: int


class Arrivals:
    """Files of a folder, and for how long each has been as it is."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._since: dict[Path, tuple[Stamp, float]] = {}

    def quiet(self, path: Path) -> float:
        """Return for how long a file has not changed, s; 0 while it is written, negative where it is not."""
        stamp = stamp_of(path)
        if stamp is None:
            self._since.pop(path, None)
            return -1.0
        now = self._clock()
        before, since = self._since.get(path, (None, now))
        if before != stamp or being_written(path):
            since = now
        self._since[path] = stamp, since
        return now - since


def stamp_of(path: Path) -> Stamp | None:
    """Return the stamp of a file; None where there is none."""
    try:
        status = path.stat()
    except OSError:
        return None
    return Stamp(status.st_ino, status.st_size, status.st_mtime_ns)


def being_written(path: Path) -> bool:
    """Tell whether a process of this machine has a file open to write, as far as the system can say.

    Linux grants a read lease of a file only while nobody has it open to write. Other systems, file systems
    of a network and files of other users grant none: then only the waiting time tells.
    """
    if not hasattr(fcntl, "F_SETLEASE"):
        return False
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    except OSError:
        return False
    try:
        # Who opens the file meanwhile makes the system send a signal, which must be one that ends no process.
        fcntl.fcntl(handle, fcntl.F_SETSIG, signal.SIGURG)
        fcntl.fcntl(handle, fcntl.F_SETLEASE, fcntl.F_RDLCK)
        fcntl.fcntl(handle, fcntl.F_SETLEASE, fcntl.F_UNLCK)
    except OSError as error:
        return error.errno == errno.EAGAIN
    finally:
        os.close(handle)
    return False
