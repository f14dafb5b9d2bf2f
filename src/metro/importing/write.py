"""The batch that is proposed for files nobody has described, with a comment at all that was guessed."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from metro.batch.cell import CELLS, shared_cells
from metro.batch.file_names import settings_in, stated_by_all
from metro.batch.whole_folder import whole_folder
from metro.formats.measures import OF_COLUMN
from metro.importing.joints import with_drive
from metro.importing.look import Seen
from metro.importing.propose import Proposal
from metro.importing.questions import needs_sensitivity

RUN_COLUMN = {
    "force": "dynamometer",
    "robot": "robot_log",
    "joints": "joint_log",
    "profile": "profile",
    "cloud": "scan",
    "path": "path",
    "slopes": "slopes",
    "poses": "poses",
}
_RUN_KEYS = (
    *("operation", "direction", "spindle_rpm", "feed_per_tooth_mm", "axial_depth_mm", "radial_depth_mm"),
    *("cut_length_mm", "feed_direction_deg", "loaded"),
)
_LONGEST, _DIGITS = 5000, 12  # characters of a citation, digits of a hash
Answers = Mapping[str, str]


class AnswerError(ValueError):
    """An answer does not fit the files: its key, what was found and what was expected."""


def write_batch(folder: Path, files: Sequence[Seen], proposals: Sequence[Proposal], answers: Answers) -> None:
    """Write the folder of a batch: the files, batch.yaml and the tables.

    Raises
    ------
    AnswerError
        An answer does not fit the files.
    ContractError
        The folder cannot be written.
    """
    proposals = [with_drive(each, answers) for each in proposals]
    texts = {
        "cell.yaml": _cell(answers),
        "batch.yaml": "\n".join(_manifest(folder.name, proposals, _cited(files, answers))) + "\n",
        "runs.csv": _runs(proposals, answers),
        "impacts.csv": _impacts(proposals, answers),
        "published.csv": _published(files),
    }
    with whole_folder(folder) as filled:
        for seen in files:
            shutil.copyfile(seen.path, filled / seen.path.name)
        for name, text in texts.items():
            if text:
                (filled / name).write_text(text, encoding="utf-8")


def _cited(files: Sequence[Seen], answers: Answers) -> Answers:
    """Add to the citation what was read from which file, and what that says of its origin."""
    read = [
        f"read from {seen.path.name} (SHA-256 {_digest(seen.path)}): {seen.origin}"
        for seen in files
        if seen.origin
    ]
    if not read:
        return answers
    given = [answers["citation"]] if answers.get("citation") else []
    text = "; ".join([*given, *read])
    return {**answers, "citation": text if len(text) <= _LONGEST else f"{text[: _LONGEST - 2]} …"}


def _digest(path: Path) -> str:
    """Return the first digits of a file's hash, as the report prints them."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:_DIGITS]


def _manifest(name: str, proposals: Sequence[Proposal], answers: Answers) -> Iterator[str]:
    """Yield the lines of batch.yaml; what was guessed says from what."""
    yield '# Written by metro import. Lines with a comment "guessed" are for you to check.'
    yield from ("format: 1", f"batch: {name}")
    if answers.get("title"):
        yield f"title: {json.dumps(answers['title'], ensure_ascii=False)}"
    modes = any(each.kind == "modes" for each in proposals)
    yield f"source: {'published' if modes else 'measured'}"
    if answers.get("citation"):
        yield f"citation: {json.dumps(answers['citation'], ensure_ascii=False)}"
    yield f"cell: {answers.get('cell', 'unknown')}"
    tool = ", ".join(f"{key[5:]}: {value}" for key, value in answers.items() if key.startswith("tool."))
    if tool:
        yield f"tool: {{{tool}}}"
    if answers.get("work.size_mm"):
        yield f"work: {{size_mm: [{answers['work.size_mm']}]}}"
    if any(each.kind == "force" for each in proposals):
        yield from _dynamometer(answers)
    names = [row for each in proposals if each.kind == "force" for row, _ in each.rows]
    for column in stated_by_all(names) if names else ():
        if column not in answers:
            yield f"# {column} of runs.csv: guessed from the files' names"
    mapped = [each for each in proposals if each.columns]
    if mapped:
        yield "files:"
        for each in mapped:
            yield from _mapping(each, answers)


def _cell(answers: Answers) -> str:
    """Return cell.yaml: that of the shared cell with the drives that were stated; "" where none were."""
    drives = {key[7:]: value for key, value in answers.items() if key.startswith("drives.")}
    name = answers.get("cell", "unknown")
    shared = shared_cells(CELLS) / f"{name}.yaml"
    given = answers.get("cell_file")
    if not drives and not given:
        return ""
    if given and not Path(given).is_file():
        raise AnswerError(f'cell_file: found "{given}", expected a file: cell.yaml of the machine')
    source = Path(given) if given else shared
    text = source.read_text(encoding="utf-8") if source.is_file() else f"cell: {name}\n"
    if not drives:
        return text
    lines = [f"  {key}: {f'[{value}]' if ',' in value else value}" for key, value in drives.items()]
    return "\n".join([text.rstrip(), "drives:", *lines, ""])


def _dynamometer(answers: Answers) -> Iterator[str]:
    reads = answers.get("dynamometer.reads", "work")
    given = [
        f"{axis}: {value.strip()}"
        for axis, value in zip("xyz", answers.get("dynamometer.axes", "").split(","), strict=False)
    ]
    axes = f", axes: {{{', '.join(given)}}}" if answers.get("dynamometer.axes") else ""
    yield "instruments:"
    if not axes:
        yield "  # The directions of the sensor's axes were not stated: taken to be those of the work frame."
    rate = f", rate_hz: {answers['rate_hz']}" if answers.get("rate_hz") else ""
    yield f"  dynamometer: {{reads: {reads}{axes}{rate}}}"


def _mapping(proposal: Proposal, answers: Answers) -> Iterator[str]:
    yield f"  {json.dumps(proposal.pattern, ensure_ascii=False)}:"
    if not proposal.timed:
        yield f"    rate_hz: {answers['rate_hz']}"
    yield "    columns:"
    for column, source in proposal.columns.items():
        given = {"file": source[0], "from": source[1]} if isinstance(source, tuple) else {"from": source}
        unit = proposal.stated.get(column) or answers[f"unit.{_quantity(column)}"]
        entry: dict[str, object] = {**given, "unit": unit}
        if needs_sensitivity(unit) and not column.startswith("current"):
            entry["sensitivity"] = answers[f"sensitivity.{_quantity(column)}"]
        text = ", ".join(f"{key}: {json.dumps(value, ensure_ascii=False)}" for key, value in entry.items())
        yield f"      {column}: {{{text}}}  # guessed from {proposal.why[column]}"


def _quantity(column: str) -> str:
    return "response" if column == "response" else OF_COLUMN.get(column.rpartition("_")[2], "response")


def _runs(proposals: Sequence[Proposal], answers: Answers) -> str:
    """Return runs.csv: a row for each record of a cut or of a face; "" where there is none."""
    used = [each for each in proposals if each.kind in RUN_COLUMN]
    rows: list[dict[str, str]] = []
    for each in used:
        for at, (name, record) in enumerate(each.rows):
            row = {"run": f"r{len(rows) + 1:02d}", RUN_COLUMN[each.kind]: name}
            if each.kind == "force":
                row |= settings_in(name.partition("#")[0])
            row |= {
                key: _of_run(key, answers[key], at, len(each.rows), record)
                for key in _RUN_KEYS
                if answers.get(key)
            }
            rows.append(row)
    return _csv(rows)


def _of_run(key: str, value: str, at: int, count: int, record: str) -> str:
    """Return the value of a run: one for all, one for each by commas, or with the record's name in it."""
    parts = [part.strip() for part in value.split(",")]
    if len(parts) > 1 and len(parts) != count:
        raise AnswerError(f"{key}: found {len(parts)} values, expected one, or {count} as there are runs")
    return (parts[at] if len(parts) > 1 else parts[0]).replace("{record}", record).replace("{number}", record)


def _impacts(proposals: Sequence[Proposal], answers: Answers) -> str:
    rows = []
    for each in proposals:
        for name, record in each.rows if each.kind in ("record", "frf") else ():
            asked = () if each.placed else ("reference", "response")
            points = {key: _numbered(key, answers[key], record) for key in asked}
            unit = answers.get("unit.response", "")
            unit = _of_sensor(answers) if needs_sensitivity(unit) else unit
            row = {"position": "1", **points, "kind": each.kind, "file": name}
            row |= {} if each.placed else {"replicate": "1"}
            rows.append(row | ({"response_unit": unit} if each.kind == "record" else {}))
    return _csv(rows)


def _of_sensor(answers: Answers) -> str:
    """Return the unit of a response that a sensitivity names."""
    sensitivity = answers.get("sensitivity.response", "")
    return next(
        (unit for unit in ("m/s2", "m/s", "g", "m") if re.search(rf"[ /(]{unit}\)?$", sensitivity)), "m/s2"
    )


def _numbered(key: str, value: str, record: str) -> str:
    if "{number}" in value and not record:
        raise AnswerError(f"{key}: asks for the number in a file's name, but there is none")
    return value.replace("{number}", record)


def _published(files: Sequence[Seen]) -> str:
    rows = []
    for seen in files:
        for mode in seen.modes:
            place = {"table": "modes", "row": str(mode.number), "observable": "modes"}
            damped = f"damped {mode.damped:.6g} Hz"
            rows.append(
                {
                    **place,
                    "quantity": "frequency",
                    "measured": f"{mode.frequency:.8g}",
                    "unit": "Hz",
                    "note": damped,
                }
            )
            rows.append(
                {**place, "quantity": "damping", "measured": f"{mode.damping:.6g}", "unit": "1", "note": ""}
            )
    return _csv(rows)


def _csv(rows: Sequence[Mapping[str, str]]) -> str:
    if not rows:
        return ""
    stream = io.StringIO()
    writer = csv.DictWriter(
        stream, list(dict.fromkeys(key for row in rows for key in row)), lineterminator="\n"
    )
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()
