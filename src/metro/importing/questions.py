"""What must be asked of a person, as it decides a number and no file says it, and which answers there are."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

from metro.batch.discover import NAME, NAME_IN_WORDS
from metro.batch.file_names import stated_by_all
from metro.formats.measures import OF_COLUMN, RESPONSES, MeasureError, first_spellings, measure
from metro.importing import joints
from metro.importing.propose import Proposal

NONE = "none"  # the answer to a question that leaves a key of batch.yaml out
RECORD = ("{record}", "{number}")  # stand for the record's name, and the number in the file's name
EXAMPLES = {
    "angle": "deg or rad",
    "torque": "Nm",
    "current": "A",
    "force": "N, kN or V",
    "length": "mm, m or inch",
    "slope": "um/m, arcsec or mrad",
    "time": "s or ms",
    "response": "m/s2, g or V",
}
OF_DRIVES = (
    "unit.drive",
    "unit.current",
)  # currents that are measured as such, by no sensor of something else
_SENSED = ("V", "mV", "A", "mA", "pC", "nC")


@dataclass(frozen=True)
class Question:
    """A question.

    Attributes
    ----------
    key : its name on the command line.
    words : the question.
    accepts : says of an answer what would be right instead; "" where it is.
    optional : whether it may stay open.
    leaves_out : whether ``none`` is an answer, which leaves the key out.
    """

    key: str
    words: str
    accepts: Callable[[str], str] = lambda _answer: ""
    optional: bool = False
    leaves_out: bool = False

    def expected(self, answer: str) -> str:
        """Say of an answer what would be right instead; "" where it is."""
        if answer == NONE:
            return (
                ""
                if self.leaves_out or self.optional
                else f"a value, without which it cannot be read: {self.words}"
            )
        return self.accepts(answer)


def questions(proposals: Sequence[Proposal]) -> Iterator[Question]:
    """Yield what must be asked of these files."""
    yield Question("batch", "name of the batch: small letters, digits and hyphens", _name)
    yield Question("title", "what was measured, in a line", optional=True)
    lacking = [each for each in proposals if joints.lacks_drive(each)]
    if lacking:
        count = joints.axes_of(lacking[0])
        what = f"columns of the measured currents or torques of the {count} joints, as 14-{13 + count}"
        yield Question(joints.DRIVE, what, partial(_span, count))
        yield _choice("unit.drive", "unit of these", ("A", "mA", "Nm", "kNm"))
    unstated = [_quantity(column) for each in proposals for column in _without_unit(each)]
    if any(each.kind == "record" and not each.columns and not each.placed for each in proposals):
        unstated.append("response")  # of a record with the contract's own columns
    for quantity in dict.fromkeys(unstated):
        words = f"unit of the {quantity} in the files, as {EXAMPLES[quantity]}"
        yield Question(f"unit.{quantity}", words, partial(_unit, quantity))
    if not all(each.timed for each in proposals):
        yield Question("rate_hz", "samples per second, Hz", _number)
    kinds = {each.kind for each in proposals}
    if "force" in kinds:
        yield from _of_cuts([name for each in proposals if each.kind == "force" for name, _ in each.rows])
    if any(each.kind in ("record", "frf") and not each.placed for each in proposals):
        number = "as 1x; {number} is the number in the file's name"
        yield Question("reference", f"where the hammer struck, point and axis, {number}", _place)
        yield Question("response", f"where the sensor was, point and axis, {number}", _place)
    if kinds & {"joints", "poses"}:
        arm = "the robot: a name of config/cells or of your own (cell_file=… copies a cell.yaml), or none"
        yield Question("cell", arm, leaves_out=True)
    if "joints" in kinds:
        rows = [name for each in proposals if each.kind == "joints" for name, _ in each.rows]
        named = ", ".join(rows)
        what = f"is a load on the flange: yes or no, one for each of {named} by commas; none: not known"
        yield Question("loaded", what, partial(_states, len(rows)), leaves_out=True)
    if "cloud" in kinds:
        size = "size of the scanned part as x,y,z in mm, or none where it is not known"
        yield Question("work.size_mm", size, _size, leaves_out=True)
    if "modes" in kinds:
        yield Question("citation", "where these values are published")


def sensitivities(answers: dict[str, str]) -> Iterator[Question]:
    """Yield the questions that follow from answers: the sensitivity of what was recorded as a voltage."""
    for key, unit in answers.items():
        if key.startswith("unit.") and key not in OF_DRIVES and needs_sensitivity(unit):
            words = "sensitivity of the sensor, as 10.2 mV/g or 200 N/V"
            yield Question(f"sensitivity.{key[5:]}", words, _sensitivity)


def needs_sensitivity(unit: str) -> bool:
    """Return whether a unit is a sensor's, of which the sensitivity must be asked."""
    return unit in _SENSED


def _of_cuts(names: Sequence[str]) -> Iterator[Question]:
    yield Question("tool.diameter_mm", "diameter of the tool, mm", _number)
    yield Question("tool.teeth", "number of teeth", _count)
    yield Question("tool.helix_deg", "helix angle, degrees", _number)
    yield _choice("dynamometer.reads", "the dynamometer reads the force on the", ("work", "tool"))
    axes = "the sensor's x,y,z in the work frame (x along the feed, z to the spindle), as y,x,-z"
    yield Question("dynamometer.axes", f"{axes}, or none", _axes, leaves_out=True)
    yield _choice("operation", "operation", ("slot", "side", "face", "helical"))
    yield _choice("direction", "direction", ("up", "down", "slot"))
    for column, words in (
        ("spindle_rpm", "spindle speed, 1/min"),
        ("feed_per_tooth_mm", "feed per tooth, mm"),
        ("axial_depth_mm", "axial depth, mm"),
        ("radial_depth_mm", "radial depth, mm"),
    ):
        if column not in stated_by_all(names):
            each = f"{words}: one value, one for each run by commas, or {{record}}"
            yield Question(column, each, _numbers)


def _choice(key: str, words: str, choices: tuple[str, ...]) -> Question:
    expected = " or ".join(choices)
    return Question(key, f"{words}: {', '.join(choices)}", lambda got: "" if got in choices else expected)


def _quantity(column: str) -> str:
    return "response" if column == "response" else OF_COLUMN[column.rpartition("_")[2]]


def _without_unit(proposal: Proposal) -> list[str]:
    return [column for column in proposal.columns if not proposal.stated.get(column)]


def _span(count: int, answer: str) -> str:
    fits = len(joints.span(answer)) == count
    return "" if fits else f"the numbers of {count} columns, as 14-{13 + count}"


def _states(count: int, answer: str) -> str:
    parts = [part.strip() for part in answer.split(",")]
    fits = set(parts) <= {"yes", "no"} and len(parts) in (1, count)
    return "" if fits else f"yes or no, or {count} of them by commas"


def _name(answer: str) -> str:
    return "" if NAME.fullmatch(answer) else NAME_IN_WORDS


def _unit(quantity: str, answer: str) -> str:
    wanted = tuple(RESPONSES) if quantity == "response" else (quantity,)
    try:
        fits = measure(answer).quantity in wanted or needs_sensitivity(answer)
    except MeasureError:
        fits = False
    return "" if fits else f"one of {', '.join([*first_spellings(wanted), *_SENSED])}"


def _sensitivity(answer: str) -> str:
    fits = re.fullmatch(r"[-+]?\d+(\.\d+)?([eE][-+]?\d+)? *[^ /]+/[^ ]+", answer)
    return "" if fits else "a number with its unit, as 10.2 mV/g or 200 N/V"


def _is_number(text: str) -> bool:
    return re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", text) is not None


def _number(answer: str) -> str:
    return "" if _is_number(answer) else "a number (a decimal takes a point, not a comma)"


def _count(answer: str) -> str:
    return "" if re.fullmatch(r"[1-9]\d*", answer) else "a whole number"


def _numbers(answer: str) -> str:
    parts = [part.strip() for part in answer.split(",")]
    fits = answer in RECORD or all(map(_is_number, parts))
    return "" if fits else "a number, numbers parted by commas, or {record}"


def _axes(answer: str) -> str:
    parts = [part.strip() for part in answer.split(",")]
    fits = sorted(part.lstrip("-+") for part in parts) == ["x", "y", "z"]
    return "" if fits else "three directions, as y,x,-z, or none"


def _size(answer: str) -> str:
    parts = [part.strip() for part in answer.split(",")]
    fits = len(parts) == 3 and all(map(_is_number, parts))
    return "" if fits else "three numbers, as 200,100,20, or none"


def _place(answer: str) -> str:
    fits = re.fullmatch(r"(?:[A-Za-z0-9_.]|\{number\})+[+-]?[xyz]", answer)
    return (
        "" if fits else "a point and an axis, as 7z (a name of your own where the point has no number: tip-z)"
    )
