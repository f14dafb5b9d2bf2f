"""Run the corpus and write its table: ``python tests/corpus docs/bad-input.csv``."""

import csv
import sys
import tempfile
from pathlib import Path

import corpus_all
import corpus_run

HEADER = ("kind", "fault", "formats", "outcome", "found by", "what is said, e.g.")
LONGEST = 240  # characters of a message that are kept


def main(target):
    """Run all cases; write the table; return the number of cases that went wrong."""
    with tempfile.TemporaryDirectory() as folder:
        results = list(corpus_run.run(corpus_all.cases(), Path(folder)))
    for result in results:
        if result.wrong:
            print(f"{result.case.name}: {result.wrong}", file=sys.stderr)
    with target.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows([HEADER, *_rows(results)])
    return sum(bool(result.wrong) for result in results)


def _rows(results):
    """Yield a row for each fault of a kind of input and each outcome; formats of one outcome share it."""
    together = {}
    for result in results:
        key = result.case.kind, result.case.fault, result.outcome.how
        together.setdefault(key, []).append(result)
    for (kind, fault, how), alike in together.items():
        formats = ", ".join(result.case.form for result in alike)
        where = ", ".join(dict.fromkeys(result.outcome.where for result in alike))
        yield kind, fault, formats, how, where, _message(alike[0])


def _message(result):
    """The message of a case that holds what it must, short and on one line."""
    said = result.outcome.said
    words = result.case.says
    message = next((m for m in said if all(word in m for word in words)), said[0] if said else "")
    text = "".join(c if c.isprintable() else "\ufffd" for c in " ".join(message.split()))
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"


if __name__ == "__main__":
    sys.exit(min(main(Path(sys.argv[1])), 1))
