"""What becomes of a batch: what the check says, how the pipeline ends, and whether the two agree."""

import contextlib
import hashlib
import json
import re
import shutil
import traceback
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import pandas as pd

from metro.batch.findings import ContractError
from metro.formats import FormatError
from metro.report import style
from metro.stages import loop as loop_module
from metro.stages.identify import identify
from metro.stages.ingest import ingest
from metro.stages.predict import predict
from metro.stages.report import report
from metro.stages.verdict import verdict
from metro.stages.whole import check_whole

GATES = {
    "model_form_budget": 0.007,
    "materiality": 0.004,
    "false_additions": 0.05,
    "held_out_gain": 3.0,
    "seed": 1,
}
BUDGET = {"model_form_budget": 0.007}
EMPTY_SVG = b'<svg xmlns="http://www.w3.org/2000/svg" width="100pt" height="50pt"/>'
CELLS = Path(__file__).parents[2] / "config/cells"
# Words of a program, which no sentence for a process engineer holds.
ODD = re.compile(
    r"\bnan\b|\bNone\b(?! of the )|\binf\b|Traceback|KeyError|Error:|cannot convert|out of bounds|zero-size"
    r"|object has no|must be|0-dimensional|singular matrix|not in index|\bdtype\b",
)


@dataclass(frozen=True)
class Outcome:
    """How a batch fared.

    Attributes
    ----------
    check : passed, refused or crashed. end : PDF, refused or crashed; "" where it was not tried.
    said : of a refusal, its messages; of a crash, where and what it was.
    odd : sentences of the results with words of a program in them.
    """

    check: str
    end: str
    said: tuple[str, ...] = ()
    odd: tuple[str, ...] = ()

    @property
    def agree(self):
        """Whether the check said beforehand what became of the batch."""
        return (self.check, self.end) in {("passed", "PDF"), ("refused", "refused")}

    @property
    def wrong(self):
        """What is wrong with the outcome, in words; "" where nothing is."""
        if "crashed" in (self.check, self.end):
            return f"crashed: {self.said[0]}"
        if not self.agree:
            return f"check {self.check}, pipeline {self.end}: {'; '.join(self.said)[:300]}"
        return f"says: {self.odd[0][:300]}" if self.odd else ""


def outcome(folder, out, seen, *, full=False):
    """Check a batch and run it to its report.

    ``out`` is a folder for what is written. ``seen`` keeps the outcomes by what ingest made: a batch that
    differs in nothing that ingest keeps is not run again. ``full``: as the pipeline runs, not :func:`light`.
    """
    shutil.rmtree(out, ignore_errors=True)
    with contextlib.nullcontext() if full else light(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            checked = check_whole(folder, CELLS)
        except Exception as error:  # the very thing that must not happen, whatever it is
            return Outcome("crashed", "", (place_of(error),))
        check = "passed" if checked.ok else "refused"
        try:
            ingest(folder, CELLS, out / "processed", {}, "code")
            made = content_of(out / "processed")
            if made in seen:
                return replace(seen[made], check=check)
            for stage in STAGES:
                stage(out / "processed", out / "reports")
        except (ContractError, FormatError) as error:
            return Outcome(check, "refused", tuple(str(error).splitlines()), odd_in([str(error)]))
        except Exception as error:  # as above
            return Outcome(check, "crashed", (place_of(error),))
    seen[made] = Outcome(check, "PDF", odd=odd_in(sentences(out)))
    return seen[made]


def content_of(processed):
    """Return a hash of what ingest made, but for the names of files and what is said of these."""
    parts = [(processed / "batch.json").read_bytes()]
    for path in sorted(processed.glob("*.parquet")):
        table = pd.read_parquet(path).drop(columns=["file", "message", "order"], errors="ignore")
        parts += [path.name.encode(), pd.util.hash_pandas_object(table, index=False).to_numpy().tobytes()]
    return hashlib.sha256(b"".join(parts)).hexdigest()


@contextlib.contextmanager
def light():
    """Let the loop know the first effect of each observable alone, and let no figure be drawn.

    All their steps are made all the same; figures are composed up to the drawing.
    """
    library, to_svg = loop_module.library, style.to_svg
    loop_module.library = lambda observable: library(observable)[:1]
    style.to_svg = lambda _: EMPTY_SVG
    try:
        yield
    finally:
        loop_module.library, style.to_svg = library, to_svg


STAGES = (
    lambda processed, _: identify(processed, BUDGET, "code"),
    lambda processed, _: predict(processed, BUDGET, "code"),
    lambda processed, reports: loop_module.loop(processed, reports, GATES, "code"),
    lambda processed, reports: verdict(processed, reports, {}, "code"),
    lambda processed, reports: report(processed, reports, {}, "code"),
)


def place_of(error):
    """Return where an exception came from: the last two places of the package, and the exception."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if "/metro/" in frame.filename]
    places = [f"{frame.filename.rpartition('/metro/')[2]}:{frame.lineno}" for frame in frames[-2:]]
    return f"{' → '.join(places)}: {type(error).__name__}: {str(error)[:150]}"


def sentences(out):
    """Yield every text of the results that a person reads."""
    for file in ("reports/identified.json", "reports/verdict.json", "processed/loop.json"):
        with contextlib.suppress(FileNotFoundError):
            yield from texts(json.loads((out / file).read_text()))


def texts(content):
    """Yield every text in what was read of a JSON file."""
    if isinstance(content, str):
        yield content
    elif isinstance(content, dict | list):
        for each in content.values() if isinstance(content, dict) else content:
            yield from texts(each)


def odd_in(said):
    """Return the sentences with words of a program in them."""
    return tuple(dict.fromkeys(each for each in said if ODD.search(each)))
