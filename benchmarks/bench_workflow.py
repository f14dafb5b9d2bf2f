"""What snakemake itself costs: a campaign of many batches in which nothing is to be done.

One batch of printed figures is brought to its report; the campaign is as many copies of it, files and results
hard-linked so that they take no room: results under other names, good for timing snakemake and for nothing
else. ``snakemake --touch`` notes them as made. Then ``snakemake --dry-run`` is timed, and beside it the plan
(batches, settings, hashes of the code), which is all that this package adds to snakemake's own work.

With ``--run``, what a whole run costs: that many simulated batches by snakemake on all cores, and the same
commands one after the other without it. The ratio of wall × cores to the commands' CPU seconds wants a quiet
machine; that of the CPU seconds does not. Run:
``python benchmarks/bench_workflow.py [--run] [100 300 1000]``.
"""

import os
import re
import shutil
import sys
import tempfile
from pathlib import Path

import numpy as np
from command_cost import cost

sys.path.insert(0, str(Path(__file__).parents[1] / "tests/shared"))

from checkout import Checkout
from program_copy import copy_program

COUNTS = (100, 300, 1000)
FIRST = "b00000"
PLAN = """
from pathlib import Path
from metro.workflow import LAST, Plan
plan = Plan.read(Path(), {})
[plan.code(stage) for stage in (*LAST, "campaign")]
"""


def campaign(folder, count):
    """Return a checkout in which so many batches are finished."""
    copy_program(folder)
    made = Checkout(folder)
    made.add_batch(FIRST)
    made.call("--cores", "1", "--quiet", "all")
    for name in (f"b{number:05d}" for number in range(1, count)):
        for parent in ("data/raw", "data/processed", "reports"):
            shutil.copytree(
                folder / parent / FIRST, folder / parent / name, copy_function=os.link, dirs_exist_ok=True
            )
        for log in (folder / "logs").glob(f"*/{FIRST}.log"):
            os.link(log, log.with_name(f"{name}.log"))
    made.call("--touch", "--cores", "1", "--quiet", "all")
    return made


def measured(counts):
    """Yield for each count of batches the costs of the dry run and of the plan."""
    for count in counts:
        with tempfile.TemporaryDirectory() as folder:
            made = campaign(Path(folder), count)
            assert "Nothing to be done" in made.call("--dry-run")
            where = {"folder": made.folder, "environment": made.environment}
            dry = cost(*made.command("--dry-run"), **where)
            yield count, dry, cost(sys.executable, "-c", PLAN, **where)


def run(count):
    """Print what a run of so many simulated batches costs, beside its commands alone."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "by-hand").mkdir()
        copy_program(Path(folder) / "by-hand")
        alone = Checkout(Path(folder) / "by-hand")
        for seed in range(count):
            simulated = ("simulate", f"b{seed}", "--effect", "tool_runout", "--seed", str(seed))
            cost(*alone.metro, *simulated, folder=alone.folder, environment=alone.environment)
        shutil.copytree(alone.folder, Path(folder) / "by-snakemake")
        led = Checkout(Path(folder) / "by-snakemake")
        whole = cost(*led.command("--quiet", "all"), folder=led.folder, environment=led.environment)
        said = alone.call("--dry-run", "--printshellcmds")
        for log in re.findall(r"> (logs/\S+)/\S+\.log", said):
            (alone / log).mkdir(parents=True, exist_ok=True)
        steps = re.findall(r"(metro (?:ingest|identify|predict|loop|report|campaign) .* 2>&1)", said)
        where = {"folder": alone.folder, "environment": alone.environment}
        spent = sum(cost("bash", "-c", step, **where).cpu for step in steps)
    print(
        f"{count} batches, {len(steps)} jobs: commands {spent:.1f} s CPU; snakemake {whole.cpu:.1f} s CPU, ",
        end="",
    )
    print(f"{whole.wall:.1f} s wall: CPU × {whole.cpu / spent:.2f}, wall × {os.cpu_count()} cores", end=" ")
    print(f"× {whole.wall * os.cpu_count() / spent:.2f}")


if __name__ == "__main__":
    counts, spent = [int(text) for text in sys.argv[1:] if text.isdigit()] or COUNTS, []
    if "--run" in sys.argv:
        for count in counts:
            run(count)
        sys.exit()
    for count, dry, plan in measured(counts):
        spent.append(dry.cpu)
        print(f"{count} batches: {dry.cpu:.2f} s CPU ({dry.wall:.2f} s wall, {dry.memory:.0f} MB), ", end="")
        print(f"of which the plan {plan.cpu:.2f} s; {1e3 * dry.cpu / count:.1f} ms per batch", flush=True)
    if len(counts) > 1:
        print(f"exponent {np.polyfit(np.log(counts), np.log(spent), 1)[0]:.2f}")
