"""What a command costs: CPU and wall seconds, and the peak of its memory."""

import os
import subprocess
import tempfile
import time
from dataclasses import dataclass


@dataclass(frozen=True)
class Cost:
    """CPU and wall seconds of a command, and the peak of its resident memory, MiB."""

    cpu: float
    wall: float
    memory: float


def cost(*command, folder, environment):
    """Run a command that must end well."""
    start = time.perf_counter()
    with tempfile.TemporaryFile() as said:
        begun = subprocess.Popen(command, cwd=folder, env=environment, stdout=said, stderr=subprocess.STDOUT)
        _, status, used = os.wait4(begun.pid, 0)
        said.seek(0)
        assert status == 0, said.read().decode()
    return Cost(used.ru_utime + used.ru_stime, time.perf_counter() - start, used.ru_maxrss / 1024)
