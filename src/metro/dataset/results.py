"""The JSON results of all batches as flat rows: identified quantities, effects, candidates, manifests."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from metro.units import JSON

Row = tuple[Any, ...]
ERROR = ("rms", "lo", "hi", "nrmse")

# View → its columns: names that end with ! are text, with # counts, the others numbers.
COLUMNS: dict[str, tuple[str, ...]] = {
    "identified": ("batch!", "name!", "value", "lo", "hi", "unit!"),
    "verdicts": (
        *("batch!", "observable!", "status!", "unit!", "noise_floor", "held_out_runs#"),
        *(f"{when}_{name}" for when in ("before", "after") for name in ERROR),
        *("effects!", "unexplained!", "next_experiment!"),
    ),
    "effects": (
        *("batch!", "observable!", "effect!", "probability", "parameter!"),
        *("value", "lo", "hi", "unit!"),
    ),
    "candidates": (
        *("batch!", "observable!", "effect!", "probability"),
        *("held_out_gain", "p_value", "size", "why_not!"),
    ),
    "batches": (
        *("batch!", "title!", "source!", "cell!", "material!"),
        *("tool_diameter_mm", "teeth#", "overhang_mm"),
    ),
}


def quantities(
    content: Any, name: str = ""
) -> Iterator[tuple[str, float | None, float | None, float | None, str]]:
    """Yield every number of a block of ``identified.json``: path, value, interval, unit.

    Parameters
    ----------
    content : a JSON value; ``{"value", "ci95", "unit"}`` is a quantity, a bare number one without interval.
    name : path of ``content``: keys joined by dots, places in lists counted from 0 in brackets, as jq has it.

    Yields
    ------
    path, value, low and high end of the 95 % interval, unit ("" where none is given). What is not known is
    None.
    """
    if isinstance(content, dict) and "value" in content:
        values, ends, unit = content["value"], content.get("ci95"), str(content.get("unit") or "")
        if isinstance(values, list):
            each = ends if isinstance(ends, list) and len(ends) == len(values) else [None] * len(values)
            for place, (value, interval) in enumerate(zip(values, each, strict=True)):
                yield (f"{name}[{place}]", _number(value), *_ends(interval), unit)
        elif not isinstance(values, str):
            yield (name, _number(values), *_ends(ends), unit)
    elif isinstance(content, dict):
        for key, part in content.items():
            yield from quantities(part, f"{name}.{key}" if name else str(key))
    elif isinstance(content, list):
        for place, part in enumerate(content):
            yield from quantities(part, f"{name}[{place}]")
    elif _number(content) is not None:
        yield name, _number(content), None, None, ""


def rows(view: str, processed: Path, reports: Path) -> list[Row]:
    """Return the rows of a view of :data:`COLUMNS`, batches in alphabetical order."""
    if view == "batches":
        return [_description(path) for path in _of_all(processed, "batch.json")]
    if view == "identified":
        return [
            (path.parent.name, *quantity)
            for path in _of_all(reports, "identified.json")
            for key, block in _read(path).items()
            if key != "format"
            for quantity in quantities(block, key)
        ]
    return [
        row
        for path in _of_all(reports, "verdict.json")
        for row in rows_of(view, path.parent.name, _read(path))
    ]


def rows_of(view: str, batch: str, verdict: JSON) -> list[Row]:
    """Return the rows of ``verdicts``, ``effects`` or ``candidates`` that a ``verdict.json`` holds."""
    make = {"verdicts": _verdict, "effects": _effects, "candidates": _candidates}[view]
    entries = (verdict.get("observables") or {}).items()
    return [row for observable, entry in entries for row in make(batch, observable, entry)]


def columns_of(view: str) -> list[str]:
    """Return the names of the columns of a view of :data:`COLUMNS`."""
    return [column.rstrip("!#") for column in COLUMNS[view]]


def _verdict(batch: str, observable: str, entry: JSON) -> Iterator[Row]:
    errors = []
    for when in ("before", "after"):
        error = entry.get(when) or {}
        errors += [error.get("rms"), *_ends(error.get("ci95")), error.get("nrmse")]
    yield (
        *(batch, observable, entry.get("status"), entry.get("unit"), entry.get("noise_floor")),
        *(len(entry.get("held_out_runs") or []), *errors),
        ", ".join(str(effect["effect"]) for effect in entry.get("effects") or []),
        (entry.get("unexplained") or {}).get("signature"),
        entry.get("next_experiment"),
    )


def _effects(batch: str, observable: str, entry: JSON) -> Iterator[Row]:
    """Yield a row for each parameter of each effect; one without parameters has one row."""
    for effect in entry.get("effects") or []:
        known = (batch, observable, effect["effect"], effect.get("probability"))
        parameters: list[Row] = list(quantities(effect.get("parameters") or {}))
        yield from ((*known, *parameter) for parameter in parameters or [(None,) * 5])


def _candidates(batch: str, observable: str, entry: JSON) -> Iterator[Row]:
    keys = ("effect", "probability", "held_out_gain", "p_value", "size", "why_not")
    for candidate in entry.get("candidates") or []:
        yield batch, observable, *(candidate.get(key) for key in keys)


def _description(path: Path) -> Row:
    content = _read(path)
    manifest = content.get("manifest") or {}
    tool, work = manifest.get("tool") or {}, manifest.get("work") or {}
    named = (manifest.get(key) for key in ("title", "source", "cell"))
    sizes = (tool.get(key) for key in ("diameter_mm", "teeth", "overhang_mm"))
    return path.parent.name, *named, work.get("material"), *sizes


def _of_all(root: Path, file: str) -> list[Path]:
    """Return a file of every batch that has it; folders that are being written begin with a dot."""
    return sorted(path for path in root.glob(f"*/{file}") if not path.parent.name.startswith("."))


def _read(path: Path) -> JSON:
    content: JSON = json.loads(path.read_text(encoding="utf-8"))
    return content


def _number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _ends(interval: Any) -> tuple[float | None, float | None]:
    if not isinstance(interval, list) or len(interval) != 2:
        return None, None
    return _number(interval[0]), _number(interval[1])
