"""``python -m field``: bring every set of foreign files in, run it, and compare with what is known of it.

The files are no part of the repository: they are in the folder ``field`` beside METRO_REAL_DATA. Each set is
brought in by ``metro import`` alone, as a user would, then all are run by snakemake; ``--write FILE`` writes
the comparison as a page.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from field.run import compared
from field.sets import SETS
from field.table import page, summary

ROOT = Path(__file__).parents[1]


def main() -> int:
    """Run the command line; return how many sets ended neither in a report nor in the refusal expected."""
    parser = argparse.ArgumentParser(prog="python -m field", description=__doc__)
    real = Path(os.environ.get("METRO_REAL_DATA", ROOT / "../shared/real"))
    parser.add_argument("--data", type=Path, default=real.parent, help="folder that holds field and real")
    parser.add_argument("--out", type=Path, default=Path("build/field"), help="folder to work in")
    parser.add_argument("--only", default="", help="sets whose name holds this")
    parser.add_argument("--write", type=Path, help="file that the page is written to")
    given = parser.parse_args()
    results = compared([one for one in SETS if given.only in one.name], given.data, given.out)
    sys.stdout.write(summary(results))
    if given.write:
        given.write.write_text(page(results), encoding="utf-8")
    return sum(bool(result.wrong) for result in results)


if __name__ == "__main__":
    sys.exit(min(main(), 1))
