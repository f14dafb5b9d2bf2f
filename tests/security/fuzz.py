"""Feed every reader with damaged files, and count what becomes of them.

``python tests/security/fuzz.py --inputs 100000`` works in a process of its own, so that a reader that
takes the process down, hangs or takes all memory is found, too. It prints a table, and the inputs that
failed by target and number. ``--only NAME --number N`` does one again, here. Stopped by Ctrl-C it prints what
it has done so far; ``--first N`` begins at a later input, so that a count may be made in parts.
"""

import argparse
import contextlib
import mmap
import os
import random
import resource
import signal
import struct
import sys
import tempfile
import time
import traceback
import warnings
from importlib import import_module
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "corpus")]
fuzz_targets = import_module("fuzz_targets")

LONGEST_S = 5.0
MOST_BYTES = 1 << 30
SLOT = struct.Struct("<q")
READ, REFUSED, FAILED = range(3)


def drawn(target, others, seed, number):
    """Return the damaged file of a number."""
    rng = random.Random(f"{seed} {target.name} {number}")
    return target.mutate(target.sample, rng.choice(others).sample, rng)


def turn(number, targets):
    """Return the place of the target of a number; the slow ones have a tenth of the others' turns."""
    turns, k = divmod(number, len(targets))
    quick = [place for place, target in enumerate(targets) if not target.slow]
    return quick[turns % len(quick)] if quick and targets[k].slow and turns % 10 else k


def peak_bytes():
    """Return the largest memory that was resident since it was last asked, and start anew."""
    text = Path("/proc/self/status").read_text()
    peak = next(int(line.split()[1]) * 1024 for line in text.splitlines() if line.startswith("VmHWM"))
    Path("/proc/self/clear_refs").write_text("5")
    return peak


def one(target, folder, data):
    """Read one damaged file: what became of it, and what went wrong."""
    before = peak_bytes()
    try:
        read = fuzz_targets.outcome(target, folder, data)
    except BaseException as error:
        where = traceback.extract_tb(error.__traceback__)
        last = next((f for f in reversed(where) if "metro" in f.filename), where[-1])
        said = " ".join(str(error).split())[:120]
        return FAILED, f"{type(error).__name__} at {Path(last.filename).name}:{last.lineno}: {said}"
    grown = peak_bytes() - before
    if grown > MOST_BYTES:
        return FAILED, f"took {grown >> 20} MiB"
    return (READ, "") if read else (REFUSED, "")


def work(state, first, last, options):
    """Go through the numbers; ``state`` holds the number at work, and the counts."""
    warnings.simplefilter("ignore")
    limit = resource.getrlimit(resource.RLIMIT_AS)
    with (
        tempfile.TemporaryDirectory(dir=options.scratch) as name,
        Path(options.log).open("a", encoding="utf-8") as log,
    ):
        targets = chosen(Path(name), options.only)
        folders = [fuzz_targets.prepared(t, Path(name) / f"t{i}") for i, t in enumerate(targets)]
        with contextlib.suppress(ValueError):
            resource.setrlimit(resource.RLIMIT_AS, (8 * MOST_BYTES, limit[1]))
        for number in range(first, last):
            SLOT.pack_into(state, 0, number)
            k = turn(number, targets)
            how, why = one(targets[k], folders[k], drawn(targets[k], targets, options.seed, number))
            at = 16 + 8 * (3 * k + how)
            SLOT.pack_into(state, at, SLOT.unpack_from(state, at)[0] + 1)
            if how == FAILED:
                log.write(f"{targets[k].name}\t{number}\t{why}\n")
                log.flush()
        SLOT.pack_into(state, 8, 1)


def chosen(scratch, only):
    """Return the targets whose names hold ``only``."""
    made = scratch / "made"
    made.mkdir()
    return [target for target in fuzz_targets.targets(made) if only in target.name]


def cpu_s(pid):
    """Return the processor time that a process has taken."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def watched(state, pid):
    """Wait for the worker; return why it ended before its time, or ""."""
    at, since, started = -1, 0.0, time.monotonic()
    while True:
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            return "" if SLOT.unpack_from(state, 8)[0] else f"took the process down, status {status}"
        number = SLOT.unpack_from(state, 0)[0]
        with contextlib.suppress(OSError):
            spent = cpu_s(pid)
            if number != at:
                at, since, started = number, spent, time.monotonic()
            elif number >= 0 and (spent - since > LONGEST_S or time.monotonic() - started > 12 * LONGEST_S):
                os.kill(pid, signal.SIGKILL)
                os.waitpid(pid, 0)
                return f"worked for more than {LONGEST_S:g} s"
        time.sleep(0.2)


def main():
    """Run, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=100_000)
    parser.add_argument("--first", type=int, default=0, help="number of the first input")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--only", default="", help="targets whose names hold this")
    parser.add_argument("--number", type=int, help="one input, in this process")
    parser.add_argument("--log", default="fuzz-failures.tsv")
    parser.add_argument("--scratch", default="/dev/shm" if Path("/dev/shm").is_dir() else None)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.scratch) as name:
        targets = chosen(Path(name), options.only)
        if options.number is not None:
            folder = fuzz_targets.prepared(targets[0], Path(name))
            data = drawn(
                targets[0], chosen(Path(tempfile.mkdtemp(dir=name)), ""), options.seed, options.number
            )
            print(fuzz_targets.outcome(targets[0], folder, data))
            return
    state = mmap.mmap(-1, 16 + 24 * len(targets))
    Path(options.log).write_text("")
    with contextlib.suppress(KeyboardInterrupt):
        run(state, targets, options)
    table(targets, state)


def run(state, targets, options):
    """Let workers go through all inputs, a new one from where one was taken down."""
    first, last = options.first, options.first + options.inputs
    while first < last:
        SLOT.pack_into(state, 0, -1)
        pid = os.fork()
        if not pid:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            work(state, first, last, options)
            os._exit(0)
        try:
            why = watched(state, pid)
        except KeyboardInterrupt:
            os.kill(pid, signal.SIGKILL)
            raise
        if not why:
            return
        at = SLOT.unpack_from(state, 0)[0]
        if at < 0:
            raise SystemExit(f"the worker did not start: {why}")
        k = turn(at, targets)
        slot = 16 + 8 * (3 * k + FAILED)
        SLOT.pack_into(state, slot, SLOT.unpack_from(state, slot)[0] + 1)
        with Path(options.log).open("a", encoding="utf-8") as log:
            log.write(f"{targets[k].name}\t{at}\t{why}\n")
        first = at + 1


def table(targets, state):
    """Print the counts of every target, and their sum."""
    counts = [
        [SLOT.unpack_from(state, 16 + 8 * (3 * k + how))[0] for how in range(3)] for k in range(len(targets))
    ]
    print("| reader | inputs | read | refused | failed |\n| --- | --- | --- | --- | --- |")
    for target, row in zip(targets, counts, strict=True):
        print(f"| {target.name} | {sum(row)} | {row[READ]} | {row[REFUSED]} | {row[FAILED]} |")
    whole = [sum(column) for column in zip(*counts, strict=True)]
    print(f"| all | {sum(whole)} | {whole[READ]} | {whole[REFUSED]} | {whole[FAILED]} |")


if __name__ == "__main__":
    main()
