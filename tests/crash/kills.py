"""Kill a workflow at random moments and finish it: ``python tests/crash/kills.py --kills 50 data/raw/…``.

Three ways in turn: the whole process group, the workflow alone (its job goes on without it), and one stage
alone. After each, no file with a final name may differ from those of an undisturbed run, and one further call
must bring all of them to the same bytes. Every run has a random hash seed, and a folder of its own.
"""

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "shared"))

from checkout import Checkout
from outputs import bytes_lost, leftovers, outputs, torn
from program_copy import copy_program

WAYS = ("all", "head", "stage")


@dataclass
class Killed:
    """What became of one kill: where it hit ("": too late), what it tore, what the next call did not mend."""

    way: str
    moment: float
    hit: str
    torn: list
    lost: list

    @property
    def survived(self):
        return not (self.torn or self.lost)


def campaign(folder, batches):
    """Return a checkout without outputs in a new folder: batches that are there, or else a small one."""
    folder.mkdir(parents=True)
    copy_program(folder)
    made = Checkout(folder)
    for batch in batches:
        shutil.copytree(batch, folder / "data/raw" / batch.name)
    if not batches:
        made.add_batch("alpha")
    return made


def kill_once(checkout, way, moment, reference):
    """Start snakemake, kill it after ``moment`` seconds (the stage then at work), and call it once more."""
    head = subprocess.Popen(
        checkout.command("--cores", "1"),
        cwd=checkout.folder,
        env=checkout.environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    time.sleep(moment)
    hit = ""
    if head.poll() is None:
        hit = kill_stage(head) if way == "stage" else stage_at_work(checkout)
        if way == "all":
            os.killpg(head.pid, signal.SIGKILL)
        if way == "head":
            head.kill()
    head.wait()
    found = torn(checkout.folder, reference)
    checkout.call("--cores", "1")
    left = [str(path) for path in leftovers(checkout.folder)]
    return Killed(way, moment, hit, found, [*bytes_lost(checkout.folder, reference), *left])


def kill_stage(head):
    """Kill the process of the stage at work, or of the next one; return its name ("" if none came)."""
    while head.poll() is None:
        for pid, name in stages(head.pid):
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                continue
            return name
        time.sleep(0.01)
    return ""


def stages(session):
    """Yield the processes of a session that run a stage: id and name of the stage."""
    command = ["ps", "-o", "pid=,args=", "-s", str(session)]
    listed = subprocess.run(command, capture_output=True, text=True, check=False)
    for line in listed.stdout.splitlines():
        words = line.split()
        if "python" in words[1] and words[2].endswith("/metro"):
            yield int(words[0]), words[3]


def stage_at_work(checkout):
    """Return the stage that wrote to its log last."""
    logs = (checkout / "logs").rglob("*.log")
    latest = max(logs, key=lambda path: path.stat().st_mtime, default=None)
    return latest.relative_to(checkout / "logs").parts[0].removesuffix(".log") if latest else "before"


def kills(folder, batches, number, seed):
    """Yield what became of each of a number of kills, at moments drawn over the time of a run.

    A run may be through before its moment comes: it is not one of the number.
    """
    undisturbed = campaign(folder / "undisturbed", batches)
    start = time.monotonic()
    undisturbed.call("--cores", "1")
    spent = time.monotonic() - start
    reference = outputs(undisturbed.folder)
    draw, done = random.Random(seed), 0
    while done < number:
        checkout = campaign(folder / f"kill-{done}", batches)
        one = kill_once(checkout, WAYS[done % len(WAYS)], draw.uniform(0.0, spent), reference)
        if one.survived:
            shutil.rmtree(checkout.folder)
        if one.hit or not one.survived:
            done += 1
            yield one


def main():
    """Run the kills, print one line for each and the sum; return how many were not survived."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("batches", nargs="*", type=Path)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=9)
    asked = parser.parse_args()
    done = []
    folder = Path(tempfile.mkdtemp(prefix="kills-"))
    for one in kills(folder, asked.batches, asked.kills, asked.seed):
        done.append(one)
        fault = "" if one.survived else f"  torn {one.torn} lost {one.lost}"
        print(f"{len(done):3d} {one.way:6s}{one.moment:7.2f} s  {one.hit:10s}{fault}", flush=True)
    bad = sum(not one.survived for one in done)
    print(f"{len(done)} kills, {len(done) - bad} survived, {sum(len(one.lost) for one in done)} files lost")
    return bad


if __name__ == "__main__":
    sys.exit(main())
