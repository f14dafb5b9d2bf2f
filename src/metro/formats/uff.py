"""Measured functions of a universal file (UFF): datasets 58 and 58b, units by dataset 164.

Written here and not taken from a package: the abscissa must come back exact although the header holds six
digits of it, and a file of several binary datasets must come back whole.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd

from metro.formats.errors import FormatError
from metro.formats.kinds import Kind, Raw
from metro.units import Array, ComplexArray

FRF, COHERENCE = 4, 6
UNITS = {8: "m", 11: "m/s", 12: "m/s2"}
DATASETS = {
    "15": "nodes", "18": "coordinate systems", "55": "data at nodes, as mode shapes", "58": "functions",
    "58b": "functions, binary", "82": "trace lines", "151": "header", "164": "units", "2411": "nodes",
    "2412": "elements", "2414": "analysis data", "2420": "coordinate systems",
}  # fmt: skip
_COMPLEX = {2: False, 4: False, 5: True, 6: True}
_BYTES = {2: 4, 4: 8, 5: 4, 6: 8}
_HEADER, _LONGEST_HEADER = 11, 2048
_MARK = re.compile(rb"^ *-1[ \r]*$", re.MULTILINE)
_CLOSE = re.compile(rb"\s*-1[ \r]*(?=\n|\Z)")


@dataclass(frozen=True)
class Function:
    """A measured function.

    Attributes
    ----------
    kind : function type of record 6: 4 frequency response, 6 coherence, …
    reference, response : point and axis, as 1x; a negative direction has turned the sign of ``values``.
    unit : of the response, SI: m, m/s or m/s2; "" where the file does not state it.
    frequency : (n,) Hz.
    values : (n,), per newton where ``kind`` is a frequency response.
    """

    kind: int
    reference: str
    response: str
    unit: str
    frequency: Array
    values: ComplexArray


def read_functions(path: Path) -> list[Function]:
    """Read the functions of frequency of a universal file in SI; other datasets are passed over.

    Raises
    ------
    FormatError
        With the number of the dataset and what was expected.
    """
    data = path.read_bytes()
    functions, length, force = [], 1.0, 1.0
    for number, (name, start, end) in enumerate(datasets(path, data), start=1):
        where = f"dataset {number} ({name})"
        try:
            if name == "164":
                length, force = _unit_factors(data[start:end])
            elif name in ("58", "58b"):
                functions += _function(data[start:end], name == "58b")
        except (ValueError, IndexError, KeyError, ArithmeticError, RecursionError) as error:
            raise FormatError(path, f"{where}: is not what universal file datasets hold: {error}") from error
    to_si = {FRF: force / length}
    return [replace(each, values=each.values * to_si.get(each.kind, 1.0)) for each in functions]


def read_uff(path: Path, kind: Kind, rows: int | None) -> Raw:
    """Read the one frequency response of a universal file; more than one: see :func:`read_functions`."""
    responses = [each for each in read_functions(path) if each.kind == FRF]
    if not responses:
        raise FormatError(path, f"{without_frf(path)}, expected {kind.title}")
    first = responses[0]
    table = pd.DataFrame(
        {"frequency_hz": first.frequency, "real": first.values.real, "imag": first.values.imag}
    )
    return Raw(table[:rows], lambda row: f"line {row + 1} of the first function")


def without_frf(path: Path) -> str:
    """Say of a universal file that it has no FRF, and what it has."""
    counts, listed = counted(datasets(path, path.read_bytes()))
    modes = ": metro import makes a table of published values of the modes" if "55" in counts else ""
    return (
        f"found no function of type {FRF} among the datasets {listed or 'of the file, which has none'}{modes}"
    )


def counted(found: Iterable[tuple[str, int, int]]) -> tuple[Counter[str], str]:
    """Count datasets by name, and list them in words."""
    counts = Counter(name for name, _, _ in found)
    listed = ", ".join(
        f"{count} × {name}" + (f" ({DATASETS[name]})" if name in DATASETS else "")
        for name, count in counts.items()
    )
    return counts, listed


def datasets(path: Path, data: bytes) -> Iterator[tuple[str, int, int]]:
    """Yield name, start and end of each dataset, its header line included; binary ones by their size."""
    at = 0
    while mark := _MARK.search(data, at):
        start = mark.end() + 1
        if not data[start:].strip():
            return
        line = data[start : start + 7].split(b"\n")[0].decode("latin-1")
        name = line[:6].strip() + line[6:].strip().lower()
        if name == "-1":  # an end mark too many
            at = start - 1
            continue
        try:
            close = _binary_close(data, start) if name == "58b" else _MARK.search(data, start)
        except (ValueError, IndexError, KeyError) as error:
            raise FormatError(path, f"dataset {name}: has no header of such a dataset: {error}") from error
        if close is None:
            raise FormatError(path, f"dataset {name}: found no end mark -1 where its data end")
        yield name, start, close.start()
        at = close.end()


def _binary_close(data: bytes, start: int) -> re.Match[bytes] | None:
    """Find the end mark of a 58b behind its data, which may hold anything.

    Their size follows from the number of values; uneven abscissae may be single in double data. The size that
    the header states is wrong in files of several programs.
    """
    lines, at = _lines(data[start : start + _LONGEST_HEADER], 1 + _HEADER)
    kind, count, even = _form(lines[7])
    ordinate = count * (1 + _COMPLEX[kind]) * _BYTES[kind]
    for abscissa in (0,) if even else (count * _BYTES[kind], count * 4):
        if close := _CLOSE.match(data, start + at + ordinate + abscissa):
            return close
    return None


def _form(line: str) -> tuple[int, int, bool]:
    """Return data type, number of values, and whether they are evenly spaced, of record 7."""
    return int(line[:10]), int(line[10:20]), int(line[20:30]) == 1


def _lines(block: bytes, count: int) -> tuple[list[str], int]:
    """Return the first lines of a block, and where the remaining block starts."""
    at, lines = 0, []
    for _ in range(count):
        end = block.index(b"\n", at)
        lines.append(block[at:end].decode("latin-1").rstrip("\r"))
        at = end + 1
    return lines, at


def _unit_factors(block: bytes) -> tuple[float, float]:
    """Length and force of a universal file's units in metres and newtons: SI value = value / factor."""
    lines, _ = _lines(block, 3)
    values = [float(lines[2][i : i + 25].replace("D", "E")) for i in (0, 25)]
    if not all(0 < value < np.inf for value in values):
        raise ValueError(f"found the unit factors {values}, expected positive numbers")
    return values[0], values[1]


def _function(block: bytes, binary: bool) -> list[Function]:
    """Return the function of a dataset; none where its abscissa is not frequency."""
    lines, at = _lines(block, 1 + _HEADER)
    where, form = lines[6].ljust(80), lines[7]
    abscissa, numerator = int(lines[8][:10]), int(lines[9][:10])
    if abscissa not in (0, 18):
        return []
    kind, count, even = _form(form)
    if count < 1:
        raise ValueError(f"found a count of {count} values, expected 1 or more")
    width = 1 + _COMPLEX[kind] + (not even)
    body = block[at:]
    table = _binary(lines[0], body, (count, width), kind) if binary else _text(body, kind, (count, width))
    response, sign = _point(where[41:51], where[51:55])
    reference, other = _point(where[66:76], where[76:80])
    measured = table[:, -2] + 1j * table[:, -1] if _COMPLEX[kind] else table[:, -1].astype(np.complex128)
    function = int(where[:5])
    turned = sign * other if function == FRF else 1
    return [
        Function(
            function,
            reference,
            response,
            UNITS.get(numerator, ""),
            _even(form[30:43], form[43:56], count) if even else table[:, 0],
            turned * measured,
        )
    ]


def _binary(header: str, body: bytes, shape: tuple[int, int], kind: int) -> Array:
    """Return the numbers (count, width) of a binary body."""
    order, form = int(header[7:13]), int(header[13:19])
    if form not in (0, 2):
        raise ValueError(f"found floating-point format {form}, expected 2 (IEEE 754)")
    count, width = shape
    code = f"{'<' if order == 1 else '>'}f{_BYTES[kind]}"
    if len(body) >= count * width * _BYTES[kind]:
        numbers: Array = np.frombuffer(body, dtype=code, count=count * width).astype(np.float64)
        return numbers.reshape(shape)
    rows = np.frombuffer(body, dtype=[("x", f"{code[0]}f4"), ("y", code, (width - 1,))], count=count)
    return np.column_stack([rows["x"], rows["y"]]).astype(np.float64)


def _text(body: bytes, kind: int, shape: tuple[int, int]) -> Array:
    """Return the numbers (count, width) of a text body, in columns of fixed width."""
    double, uneven = _BYTES[kind] == 8, shape[1] > 1 + _COMPLEX[kind]
    widths = [20] * 4 if double else [13] * 6
    if double and uneven:
        widths = [13, 20, 20] if _COMPLEX[kind] else [13, 20, 13, 20]
    edges = np.concatenate([[0], np.cumsum(widths)])
    values = []
    for line in body.decode("latin-1").replace("D", "E").splitlines():
        fields = (line[a:b] for a, b in pairwise(edges))
        values += [float(field) for field in fields if field.strip()]
    if len(values) < shape[0] * shape[1]:
        raise ValueError(f"found {len(values)} numbers, expected {shape[0] * shape[1]}")
    return np.array(values[: shape[0] * shape[1]]).reshape(shape)


def _point(node: str, direction: str) -> tuple[str, int]:
    """Return point and axis, and the sign of its direction."""
    way = int(direction)
    if abs(way) not in (1, 2, 3):
        raise ValueError(f"found direction {way}, expected a translation: ±1, ±2 or ±3")
    return f"{int(node)}{'xyz'[abs(way) - 1]}", 1 if way > 0 else -1


def _even(first: str, step: str, count: int) -> Array:
    """Return evenly spaced lines from a first line and a step of six printed digits.

    The step is the simplest fraction that prints like that (a sampling rate over a number of samples), and
    the first line a multiple of it where that prints alike.
    """
    df = float(_simplest(step))
    start = round(float(first) / df) * df
    slack = _half_unit(first)
    begin = start if abs(start - float(first)) <= slack else float(first)
    return np.asarray(begin + df * np.arange(count), dtype=np.float64)


def _half_unit(text: str) -> float:
    """Half a unit of the last printed digit, and a little for the rounding of a tie."""
    mantissa, _, exponent = text.strip().upper().replace("D", "E").partition("E")
    digits = len(mantissa.partition(".")[2])
    return 0.50001 * 10.0 ** (int(exponent or 0) - digits)


def _simplest(text: str) -> Fraction:
    """Return the fraction of smallest denominator within half a unit of the last digit (Stern and Brocot)."""
    value, slack = Fraction(float(text)), Fraction(_half_unit(text))
    low, high = value - slack, value + slack
    return value if low <= 0 else _between(low, high)


def _between(low: Fraction, high: Fraction) -> Fraction:
    whole = -(-low.numerator // low.denominator)
    if whole <= high:
        return Fraction(whole)
    below = whole - 1
    return below + 1 / _between(1 / (high - below), 1 / (low - below))
