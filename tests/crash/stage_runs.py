"""The stages of a small batch, each run in a process of its own that may be killed at a chosen point."""

import multiprocessing
import os
import resource
import shutil
import signal
import sys
import tempfile
from pathlib import Path

import checkout
from outputs import outputs

from metro.batch.findings import ContractError
from metro.batch.template import new_batch
from metro.stages.campaign import campaign
from metro.stages.identify import identify
from metro.stages.ingest import ingest
from metro.stages.loop import loop
from metro.stages.predict import predict
from metro.stages.report import report
from metro.stages.verdict import verdict

ROOT = Path(__file__).parents[2]
CODE = "0" * 64
GATES = {
    "model_form_budget": 0.007,
    "materiality": 0.004,
    "false_additions": 0.05,
    "held_out_gain": 3.0,
    "seed": 1,
}
BUDGET = {"model_form_budget": 0.007}
RAW, PROCESSED, REPORTS = Path("data/raw/alpha"), Path("data/processed/alpha"), Path("reports/alpha")

# Stage → the stage itself, in a working folder.
STAGES = {
    "ingest": lambda at: ingest(at / RAW, ROOT / "config/cells", at / PROCESSED, {}, CODE),
    "identify": lambda at: identify(at / PROCESSED, BUDGET, CODE),
    "predict": lambda at: predict(at / PROCESSED, BUDGET, CODE),
    "loop": lambda at: loop(at / PROCESSED, at / REPORTS, GATES, CODE),
    "verdict": lambda at: verdict(at / PROCESSED, at / REPORTS, {}, CODE),
    "report": lambda at: report(at / PROCESSED, at / REPORTS, {}, CODE),
    "campaign": lambda at: campaign([at / REPORTS], at / "data/processed", at / "reports", {}, CODE),
}
# What is called by hand, and writes a folder.
BY_HAND = {"new-batch": lambda at: new_batch(at / "data/raw", "my-cut")}
# What happens to files; what is written into one that is there already is not told of.
EVENTS = {"open", "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.chmod"}
WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT

# Each child comes from a process that has imported the stages and started no thread: forked from one with
# threads, those of Typst among them, it would wait for ever.
CLEAN = multiprocessing.get_context("forkserver")
CLEAN.set_forkserver_preload([__name__])


class Undisturbed:
    """A small batch brought to its report once: the folder before each stage, and its files after it."""

    def __init__(self, folder, **batch):
        self.before, self.after = {}, {}
        work = folder / "work"
        work.mkdir(parents=True)
        checkout.Checkout(work).add_batch("alpha", **batch)
        for stage in STAGES:
            self.before[stage] = folder / f"before-{stage}"
            shutil.copytree(work, self.before[stage])
            assert run(stage, work) == (0, "")
            self.after[stage] = outputs(work)


def run(stage, folder):
    """Run a stage in a folder, undisturbed; return its exit code and what it said, as all of these do."""
    return _in_child(_run, stage, folder)


def killed_at_event(stage, folder, number):
    """Run a stage that is killed right before the given number of changes to files below its folder."""
    return _in_child(_killed_at_event, stage, folder, number)


def killed_within_write(stage, folder, size):
    """Run a stage that the kernel ends when a file that it writes grows beyond ``size`` bytes."""
    return _in_child(_killed_within_write, stage, folder, size)


def refused_beyond(stage, folder, size):
    """Run a stage that may not write a file larger than ``size`` bytes, and is told so by an error."""
    return _in_child(_refused_beyond, stage, folder, size)


def _in_child(work, *arguments):
    """Run in a process of its own; the code is negative where a signal ended it."""
    with tempfile.NamedTemporaryFile("r") as said:
        child = CLEAN.Process(target=_heard, args=(said.name, work, *arguments))
        child.start()
        child.join()
        return child.exitcode, said.read()


def _heard(said, work, *arguments):
    os.dup2(os.open(said, os.O_WRONLY), 2)
    try:
        work(*arguments)
    except ContractError as error:
        os.write(2, str(error).encode())
        sys.exit(2)


def _run(stage, folder):
    (STAGES | BY_HAND)[stage](folder)


def _killed_at_event(stage, folder, number):
    seen = 0

    def watch(event, arguments):
        nonlocal seen
        if event not in EVENTS or not str(arguments[0]).startswith(str(folder)):
            return
        seen += event != "open" or bool(arguments[2] & WRITES)
        if seen == number:
            os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(watch)
    (STAGES | BY_HAND)[stage](folder)


def _killed_within_write(stage, folder, size):
    signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    _refused_beyond(stage, folder, size)


def _refused_beyond(stage, folder, size):
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    (STAGES | BY_HAND)[stage](folder)
