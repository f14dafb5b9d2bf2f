"""Who is at work in a folder: one workflow at a time, and none beside the jobs that a killed one left behind.

Snakemake's own lock is a file that a killed run leaves for a person to remove. The locks here are the
kernel's and end with the process that holds them, in whatever way it ends.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# Held by the workflow, alone.
WORKFLOW = Path(".snakemake/metro.lock")
# Held by all of its jobs together. A job outlives a workflow that was killed, and writes when it is done.
JOBS = Path(".snakemake/metro.jobs")


def only_one_at_work(folder: Path) -> None:
    """Take a working folder for this process until it ends, once no job is at work there any more.

    Raises
    ------
    RuntimeError
        Another workflow has taken the folder.
    """
    descriptor = os.open(folder / WORKFLOW, os.O_CREAT | os.O_RDWR)  # never closed
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise RuntimeError(
            f"another snakemake is at work in {folder.resolve()}: wait until it ends"
        ) from None
    with (folder / JOBS).open("a") as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            sys.stderr.write(
                "waiting for the jobs that a killed snakemake left at work here. They end by themselves; "
                "`ps -C metro -o pid,args` lists them, `kill` ends them at once\n"
            )
            fcntl.flock(stream, fcntl.LOCK_EX)


@contextmanager
def job_at_work(folder: Path) -> Iterator[None]:
    """Mark a folder as one that a job works in while this block runs, where workflows run there."""
    if not (folder / JOBS).exists():
        yield
        return
    with (folder / JOBS).open() as stream:
        fcntl.flock(stream, fcntl.LOCK_SH)
        yield


def remove_leftovers(*roots: Path) -> None:
    """Remove what jobs of a killed run were writing: files and folders named ``.<name>.<8 letters>``."""
    for path in [path for root in roots for path in root.rglob(".*.????????")]:
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)
