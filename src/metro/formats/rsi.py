"""Robot logs as recorded KUKA RSI telegrams: ``<Rob …>…</Rob>``, one per line or one after the other.

Each interpolation cycle sends one telegram, stamped IPOC in ms: AIPos and ASPos hold the actual and the
commanded axis angles in degrees, from A1 to the last that the first telegram has; GearTorque (or Torque) the
joint torques in N m; MACur the motor currents.
Text between telegrams (a logger's time stamps, the ``<Sen …>`` answers) is passed over.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as Xml

import numpy as np
import pandas as pd

from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.formats.packets import Note, in_order
from metro.joint_columns import AXES
from metro.units import MS

STARTS = (b"<Rob ", b"<Rob>")

_TELEGRAM = re.compile(rb"<Rob[\s>].*?(?=<Rob[\s>]|\Z)", re.DOTALL)
_END = b"</Rob>"
_ANGLES = {"ASPos": "q{}_set_deg", "AIPos": "q{}_deg"}
_TORQUES = ("GearTorque", "Torque", "MACur")  # the first that is there is taken
_DIGITS = 18  # of IPOC: more do not fit 64 bits
_TORQUE = "tau{}_nm"


class _Telegram(NamedTuple):
    at: int
    rob: Xml.Element


class _Recording:
    """The well-formed telegrams of a file in the order of arrival, and how many were torn."""

    def __init__(self, path: Path, rows: int | None) -> None:
        self.path, self.data, self.torn = path, path.read_bytes(), 0
        self.telegrams = list(islice(self._parsed(), rows))

    def _parsed(self) -> Iterator[_Telegram]:
        for match in _TELEGRAM.finditer(self.data):
            text, end, _ = match[0].partition(_END)
            try:
                yield _Telegram(match.start(), Xml.fromstring(text + end))
            except Xml.ParseError:
                self.torn += 1

    def place(self, index: int) -> str:
        """Name a telegram by its number among those that could be read, and its line."""
        line = self.data.count(b"\n", 0, self.telegrams[index].at) + 1
        return f"telegram {index + 1} on line {line}"

    def number(self, index: int, column: str, text: str | None) -> float:
        if text is None:
            return np.nan
        try:
            return float(text)
        except ValueError:
            fault = f"column {column}: found {text!r}, expected a number"
            raise FormatError(self.path, f"{self.place(index)}, {fault}") from None

    def cycle(self, index: int) -> int:
        text = (self.telegrams[index].rob.findtext("IPOC") or "").strip()
        if not (text.isascii() and text.isdecimal() and len(text) <= _DIGITS):
            fault = f"found {text[:40]!r}" if text else "found none"
            raise FormatError(self.path, f"{self.place(index)}, IPOC: {fault}, expected whole milliseconds")
        return int(text)


def read_rsi(path: Path, kind: Kind, rows: int | None) -> Raw:
    """Read recorded telegrams; ``t_s`` is IPOC, so lost telegrams are gaps in it.

    Late telegrams are put in order, repeated ones left out, torn ones are lost; the notes of the table state
    how many of each, how many late answers the controller counted (Delay), and if torques are currents.

    Raises
    ------
    FormatError
        Where no telegram is whole, an element is missing, or a value is not a number.
    """
    recording = _Recording(path, rows)
    if not recording.telegrams:
        torn = f", {recording.torn} torn" if recording.torn else ""
        raise FormatError(path, f"found no whole telegram <Rob …>…</Rob>{torn}, expected {kind.title}")
    elements = _elements(recording, kind)
    columns = [(tag, f"A{i}", name.format(i)) for tag, name in elements.items() for i in _axes(recording)]
    values = np.empty((len(recording.telegrams), len(columns)))
    cycles = np.empty(len(recording.telegrams), dtype=np.int64)
    late_answers = 0.0
    for index, (_, rob) in enumerate(recording.telegrams):
        cycles[index] = recording.cycle(index)
        attributes = {child.tag: child.attrib for child in rob}
        try:
            values[index] = [float(attributes[tag][axis]) for tag, axis, _ in columns]
        except (KeyError, ValueError):
            texts = [attributes.get(tag, {}).get(axis) for tag, axis, _ in columns]
            values[index] = [
                recording.number(index, name, text) for (_, _, name), text in zip(columns, texts, strict=True)
            ]
        counter = recording.number(index, "Delay", attributes.get("Delay", {}).get("D", "0"))
        late_answers = max(late_answers, counter)
    take, notes = in_order(path, "IPOC", (cycles, MS), values, recording.place)
    frame = pd.DataFrame(values[take], columns=[name for _, _, name in columns])
    frame.insert(0, "t_s", cycles[take] * MS)
    frame = frame[[name for name in kind.columns if name in frame]]
    frame.attrs["notes"] = [*notes, *_notes(recording.torn, late_answers, elements)]
    return Raw(frame, lambda row: recording.place(int(take[row])))


def _elements(recording: _Recording, kind: Kind) -> dict[str, str]:
    """Give the elements to read, by the first whole telegram, with the names of their columns."""
    present = [child.tag for child in recording.telegrams[0].rob]
    torque = next((tag for tag in _TORQUES if tag in present), None)
    missing = [tag for tag in _ANGLES if tag not in present]
    if missing or torque is None:
        lacks = ", ".join([*missing, *([] if torque else [" or ".join(_TORQUES)])])
        listed = f"found {', '.join(present) or 'none'}"
        expected = f"expected the axis angles {', '.join(_ANGLES)} and a torque of {kind.title}"
        raise FormatError(
            recording.path, f"{recording.place(0)}: lacks the element {lacks}: {listed}, {expected}"
        )
    return {**_ANGLES, torque: _TORQUE}


def _axes(recording: _Recording) -> range:
    """Return the numbers of the axes, up to the last of which the first whole telegram has an angle."""
    angles = [child.attrib for child in recording.telegrams[0].rob if child.tag in _ANGLES]
    return range(1, 1 + max((i for i in AXES if any(f"A{i}" in each for each in angles)), default=0))


def _notes(torn: int, late_answers: float, elements: dict[str, str]) -> list[Note]:
    notes = []
    if torn:
        message = f"{torn} telegrams are torn and were left out: the recorder lost data"
        notes.append(Note("torn packets", float(torn), 0.0, False, message))
    if late_answers > 0:
        message = (
            f"the controller counted {late_answers:.0f} late answers (Delay): the sensor PC was too slow"
        )
        notes.append(Note("late answers", late_answers, 0.0, False, message))
    if "MACur" in elements:
        message = "the telegrams hold motor currents (MACur) and no torques: their numbers are taken as N m"
        notes.append(Note("torque unit", np.nan, np.nan, False, f"{message}; record GearTorque instead"))
    return notes
