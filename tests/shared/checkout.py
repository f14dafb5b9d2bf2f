"""A small checkout in a folder of its own, in which snakemake is called for real."""

import os
import re
import subprocess
import sys
from pathlib import Path

BIN = Path(sys.executable).parent

BATCH = """\
format: 1
batch: {name}
title: {title}
source: published
citation: nobody, nowhere
cell: kr160
"""
PUBLISHED = """\
table,row,observable,quantity,axis,measured,predicted,unit,printed_error_percent,note
1,1,force,mean force,x,101.5,{value},N,1.5,
1,2,force,mean force,y,203.1,200.0,N,1.5,
"""


class Checkout:
    """A folder that holds a copy of the workflow and of the package, and small batches of its own."""

    def __init__(self, folder):
        self.folder = folder
        search = os.pathsep.join([str(folder / "src"), *filter(None, [os.environ.get("PYTHONPATH")])])
        self.environment = {**os.environ, "PYTHONPATH": search, "OPENBLAS_NUM_THREADS": "1"}

    def __truediv__(self, path):
        return self.folder / path

    @property
    def metro(self):
        return [sys.executable, "-c", "from metro.cli import app; app()"]

    def command(self, *arguments):
        return [str(BIN / "snakemake"), *arguments]

    def call(self, *arguments, succeeds=True, cwd=None):
        """Call snakemake; return what it printed."""
        done = subprocess.run(
            self.command(*arguments),
            cwd=cwd or self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
            timeout=600,
        )
        assert (done.returncode == 0) == succeeds, done.stdout
        return done.stdout

    def planned(self, *arguments):
        """Return the jobs that a call would run: stage → names of batches (or "all" for the summary)."""
        printed = self.call("--dry-run", "--printshellcmds", *arguments)
        jobs = re.findall(r"> logs/(\w+)(?:/([\w-]+))?\.log", printed)
        assert jobs or "Nothing to be done" in printed, printed
        return {stage: {batch or "all" for name, batch in jobs if name == stage} for stage, _ in jobs}

    def add_batch(self, name, root="data/raw", value=100.0, title="Two printed pairs"):
        folder = self.folder / root / name
        folder.mkdir(parents=True)
        (folder / "batch.yaml").write_text(BATCH.format(name=name, title=title))
        (folder / "published.csv").write_text(PUBLISHED.format(value=value))
        return folder

    def edit(self, path, old, new):
        text = (self.folder / path).read_text()
        assert old in text
        (self.folder / path).write_text(text.replace(old, new, 1))
