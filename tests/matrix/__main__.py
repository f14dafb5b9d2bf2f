"""Take every batch apart, run what is left to its report, and print what became of it.

``python tests/matrix [--pairs N] [--only WORD] [--kind KIND] [--thin N] [--full]``: each batch less each
file, table, column, key, instrument and run, pairs of these (N drawn of each batch), one or two kinds of
measurement alone, batches made without a plan, and every batch in every cell. ``--full``: with the whole
library of effects, and figures that are drawn.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import matrix_run


def main():
    """Run the matrix; return how many cases went wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=20)
    parser.add_argument("--only", default="", help="batches whose name holds this")
    parser.add_argument("--kind", default="", help="cases of this kind")
    parser.add_argument("--thin", type=int, default=1, help="every so many cases of a batch")
    parser.add_argument("--full", action="store_true", help="as the pipeline runs, which takes long")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        results = []
        for result in matrix_run.run(
            Path(place), given.only, given.kind, given.pairs, given.thin, full=given.full
        ):
            results.append(result)
            end = result.outcome.wrong or ": ".join([result.outcome.end, *result.outcome.said[:1]])[:250]
            print(f"{result.batch}: {result.case.kind}: {result.case.name}: {end}", flush=True)
    print(matrix_run.table(results))
    return sum(bool(result.outcome.wrong) for result in results)


if __name__ == "__main__":
    sys.exit(min(main(), 1))
