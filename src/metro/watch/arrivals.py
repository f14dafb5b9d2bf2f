"""When a file is complete: it has not changed for a while, and nobody on this machine has it open to write.

A copy over a network may pause, and some programs give a file its full size before they fill it. No waiting
time is safe against all of that. So a file must also be readable and hold the whole cut; one that is not is
given :data:`PATIENCE_S` before that is said, and so is a text that ends within a line.
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
# Programs that copy write several times a second. Where the system says that nobody has the file open to
# write, a short rest is enough; where it cannot say so, the rest is as long as three seconds from the last
# byte to the judgement allow.
QUIET_S, UNSURE_S = 0.75, 1.5
HEAD_START_S = 0.2  # of rest, after which a file is read on trial: nothing is said until it has rested enough
PATIENCE_S = 5.0
TEXTS = {".csv", ".txt", ".asc", ".dat"}


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

    def complete(self, path: Path) -> bool:
        """Return whether a file has been at rest for long enough to be read."""
        quiet = self.quiet(path)
        if quiet < QUIET_S:
            return False
        if quiet < UNSURE_S and being_written(path) is None:
            return False
        return quiet >= PATIENCE_S or not _ends_within_a_line(path)


def stamp_of(path: Path) -> Stamp | None:
    """Return the stamp of a file; None where there is none."""
    try:
        status = path.stat()
    except OSError:
        return None
    return Stamp(status.st_ino, status.st_size, status.st_mtime_ns)


def being_written(path: Path) -> bool | None:
    """Return whether a process of this machine has a file open to write; None where the system cannot say.

    Linux grants a read lease of a file only while nobody has it open to write. Other systems, file systems
    of a network and files of other users grant none.
    """
    if not hasattr(fcntl, "F_SETLEASE"):
        return None
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    except OSError:
        return None
    try:
        # Who opens the file meanwhile makes the system send a signal, which must be one that ends no process.
        fcntl.fcntl(handle, fcntl.F_SETSIG, signal.SIGURG)
        fcntl.fcntl(handle, fcntl.F_SETLEASE, fcntl.F_RDLCK)
        fcntl.fcntl(handle, fcntl.F_SETLEASE, fcntl.F_UNLCK)
    except OSError as error:
        return True if error.errno == errno.EAGAIN else None
    finally:
        os.close(handle)
    return False


def _ends_within_a_line(path: Path) -> bool:
    """Return whether a text lacks the end of its last line, as most texts do that are not all there."""
    if path.suffix.lower() not in TEXTS:
        return False
    try:
        with path.open("rb") as stream:
            end = stream.seek(0, os.SEEK_END)
            stream.seek(max(end - 1, 0))
            return stream.read(1) not in (b"\n", b"\r")
    except OSError:
        return True
