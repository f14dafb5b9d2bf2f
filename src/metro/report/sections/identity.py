"""What a signature is for: who measured, when, at what temperature, with which calibrated instruments."""

from __future__ import annotations

from metro.report.content import Heading, Item, Table
from metro.report.numbers import words
from metro.report.results import Results

NOT_STATED = "not stated"


def identity(results: Results) -> list[Item]:
    """Tabulate operator, date and temperature, and the instruments with serial number and calibration.

    Nothing where ``batch.yaml`` states none of it: a table of blanks identifies nobody.
    """
    manifest = results.batch.manifest
    measured = manifest.get("measurement") or {}
    instruments = manifest.get("instruments") or {}
    keys = ("serial", "certificate", "calibration_due")
    if not measured and not any(set(keys) & set(each or {}) for each in instruments.values()):
        return []
    temperature = measured.get("temperature_c")
    made = [
        ["operator", str(measured.get("operator") or NOT_STATED)],
        ["date", str(measured.get("date") or NOT_STATED)],
        ["temperature", NOT_STATED if temperature is None else f"{temperature:g} °C"],
    ]
    rows = [
        [words(name), *(str((each or {}).get(key) or NOT_STATED) for key in keys)]
        for name, each in instruments.items()
    ]
    items: list[Item] = [
        Heading("Measurement and instruments"),
        Table(["measurement", ""], made, "Who measured, when, and at what temperature.", [1, 3]),
    ]
    if rows:
        header = ["instrument", "serial number", "certificate", "calibration due"]
        items.append(Table(header, rows, "Instruments and their calibration.", [1, 1, 1, 1]))
    return items
