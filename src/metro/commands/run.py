"""``metro run``: bring reports up to date in any folder that has batches; snakemake does the work."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from metro.commands.which import raw_folder
from metro.commands.workflow_file import workflow_file


def run(given: Sequence[str], snakefile: Path | None, cores: int, dry_run: bool) -> int:
    """Call snakemake in this folder; return its exit code.

    Parameters
    ----------
    given : batches, by name or folder; none: all of them and the summary.
    snakefile : as in :func:`workflow_file`. cores : 0: all. dry_run : only say what would run.
    """
    targets = [f"reports/{raw_folder(batch).resolve().name}/report.pdf" for batch in given]
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(workflow_file(snakefile))]
    command += ["--cores", str(cores or "all"), *(["--dry-run"] if dry_run else []), *targets]
    return subprocess.run(command, check=False).returncode
