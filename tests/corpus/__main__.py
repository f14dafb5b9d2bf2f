"""Run the corpus and write its table: ``python tests/corpus docs/bad-input.md``."""

import sys
import tempfile
from collections import Counter
from pathlib import Path

import corpus_all
import corpus_run

HEAD = """# Bad input

What becomes of input that is broken in the ways that happen in a laboratory. Made by
`python tests/corpus docs/bad-input.md`, which breaks small sound batches, one fault at a time, and runs
the check and the ingest stage on each; the tests run the same cases.

- **refused**: an error that names file, place, what was found and what was expected; nothing is computed,
  other batches go on.
- **flagged**: the analysis goes on, what is not fit for use is left out, and the report's first page says so.
- **read**: harmless; the same canonical tables as of the sound batch.

"""


def main(target):
    """Run all cases; write the table; return the number of cases that went wrong."""
    with tempfile.TemporaryDirectory() as folder:
        results = list(corpus_run.run(corpus_all.cases(), Path(folder)))
    for result in results:
        if result.wrong:
            print(f"{result.case.name}: {result.wrong}", file=sys.stderr)
    target.write_text(_document(results), encoding="utf-8")
    return sum(bool(result.wrong) for result in results)


def _document(results):
    count = Counter(result.outcome.how for result in results)
    told = ", ".join(f"{count[how]} {how}" for how in ("refused", "flagged", "read"))
    other = sum(count.values()) - sum(count[how] for how in ("refused", "flagged", "read"))
    parts = [HEAD, f"{len(results)} cases: {told}; {other} crashed.\n\n"]
    parts += ["| kind | cases | refused | flagged | read |\n| --- | --- | --- | --- | --- |\n"]
    for kind in corpus_all.kinds():
        of_kind = Counter(r.outcome.how for r in results if r.case.kind == kind)
        cells = " | ".join(str(of_kind[how]) for how in ("refused", "flagged", "read"))
        parts.append(f"| {kind} | {sum(of_kind.values())} | {cells} |\n")
    for kind in corpus_all.kinds():
        parts.append(f"\n## {kind}\n\n| fault | formats | outcome | found by | what is said, e.g. |\n")
        parts.append("| --- | --- | --- | --- | --- |\n")
        rows = {}
        for result in (r for r in results if r.case.kind == kind):
            rows.setdefault((result.case.fault, result.outcome.how), []).append(result)
        for (fault, how), alike in rows.items():
            forms = ", ".join(r.case.form for r in alike) or ""
            where = ", ".join(dict.fromkeys(r.outcome.where for r in alike))
            parts.append(f"| {fault} | {forms} | {how} | {where} | {_cell(alike[0])} |\n")
    return "".join(parts)


def _cell(result):
    """The message of a case that holds what it must, short and on one line."""
    said = result.outcome.said
    words = result.case.says
    message = next((m for m in said if all(word in m for word in words)), said[0] if said else "")
    text = " ".join(message.split()).replace("|", "\\|").replace("<", "&lt;").replace("*", "\\*")
    text = "".join(c if c.isprintable() else "�" for c in text)
    return text if len(text) <= 240 else f"{text[:239]}…"


if __name__ == "__main__":
    sys.exit(min(main(Path(sys.argv[1])), 1))
