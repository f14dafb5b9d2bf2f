"""``metro check --json``: what the check of batches says, for programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from metro.batch.check import check
from metro.commands.output import print_json


def check_as_json(folders: Sequence[Path], cells: Path) -> int:
    """Print the checks of several batches as a list; return the exit code, 1 where one has an error."""
    reports = [check(folder, cells) for folder in folders]
    print_json(
        [
            {
                "batch": str(report.folder),
                "ok": report.ok,
                "there": report.there,
                "holdout": report.plan,
                "observables": [asdict(one) for one in report.capabilities],
                "problems": [asdict(one) for one in report.problems],
            }
            for report in reports
        ]
    )
    return int(not all(report.ok for report in reports))
