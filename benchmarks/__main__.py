"""Every benchmark in one table: ``python -m benchmarks [--quick] [NAME …]``.

CPU seconds of one core, the best of a few; memory is the peak of what NumPy and Python allocate on the way.
Fails where an operation has become slow by comparison with its peer or its floor in the same run, never by
the clock. ``--quick`` leaves out the largest sizes.
"""

import os
import sys
import time
import tracemalloc
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
from operations import OPERATIONS

HEAD = ("operation", "size", "CPU s", "peers ÷ ours", "ours ÷ floor", "exponent", "MiB")
ENOUGH, MOST = 1.0, 3  # CPU seconds and calls


def seconds(work):
    """Least CPU seconds of a few calls."""
    spent = []
    while not spent or (sum(spent) < ENOUGH and len(spent) < MOST):
        start = time.process_time()
        work()
        spent.append(time.process_time() - start)
    return min(spent)


def memory(work):
    """Peak of what is allocated, MiB."""
    tracemalloc.start()
    work()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak / 2**20


def compared(operation, spent):
    """Return the cells of peers and floor, and what has become too slow."""
    cells, slow = [], []
    for peer in operation.peers:
        try:
            work, times = peer.make(operation.at)
        except ImportError:
            cells.append(f"{peer.name}: not installed")
            continue
        ratio = times * seconds(work) / spent
        cells.append(f"{peer.name}: {ratio:.3g}")
        slow += [f"{operation.name}: {ratio:.3g} × {peer.name}"] if ratio < peer.least else []
    floor = spent / seconds(operation.floor(operation.at))
    slow += [f"{operation.name}: {floor:.3g} × {operation.floor_name}"] if floor > operation.most else []
    return "; ".join(cells) or "–", f"{operation.floor_name}: {floor:.3g}", slow


def row(operation, sizes):
    """Time an operation at all sizes; return the cells of its row, and what has become too slow."""
    spent = {}
    for size in sizes:
        work = operation.make(size)
        work()
        spent[size] = seconds(work)
    peers, floor, slow = compared(operation, spent[operation.at])
    exponent = "–"
    if len(sizes) > 1:
        last = sizes[-2:]
        exponent = f"{np.polyfit(np.log(last), np.log([spent[size] for size in last]), 1)[0]:.2f}"
    times = ", ".join(f"{one:.3g}" for one in spent.values())
    count = ", ".join(f"{size:,}".replace(",", " ") for size in sizes)
    peak = f"{memory(operation.make(operation.at)):.0f}"
    return (operation.name, f"{count} {operation.unit}", times, peers, floor, exponent, peak), slow


def main(words):
    """Print the table; return what has become too slow."""
    quick, names = "--quick" in words, [word for word in words if not word.startswith("-")]
    print("| " + " | ".join(HEAD) + " |\n" + "|" + " --- |" * len(HEAD))
    slow = []
    for operation in OPERATIONS:
        if names and not any(name in operation.name for name in names):
            continue
        sizes = [s for s in operation.sizes if not quick or s == operation.at or s < operation.sizes[-1]]
        cells, more = row(operation, sizes)
        print("| " + " | ".join(cells) + " |", flush=True)
        slow += more
    return slow


if __name__ == "__main__":
    too_slow = main(sys.argv[1:])
    sys.exit("slower than it was: " + "; ".join(too_slow) if too_slow else 0)
