"""What the rows of impacts, loads, mass and stations must fulfil beyond the type of each cell."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from metro.batch.findings import Finding
from metro.batch.tables import Table
from metro.joint_columns import POSITIONS, TURNS, axes_of, stated

STIFFNESS_N_MM = (10.0, 2e5)  # softer than any arm … stiffer than any machine tool
CLOSEST_MM = 1.0
QUATERNION = 0.01  # by which the length of one with two digits may differ from 1
NEAREST_MM = 10.0  # no flange of an arm comes as near to the base
MASSES_KG = (1.0, 2e4)
ALONG = 1.0 - 1e-4  # cosine of the angle between two forces along one line
AGAINST = "the tip moves against its load, expected with it: a sign is wrong, or two axes are exchanged"
SELF_DESCRIBING = (".uff", ".unv", ".uf")  # universal files carry points, axes, kind and unit themselves


def impact_findings(table: Table) -> Iterator[Finding]:
    """Check that a hammer record or FRF states where, and in what unit, it was taken."""
    for position, row in table.sound():
        if str(row["file"]).lower().endswith(SELF_DESCRIBING):
            continue
        for column in ("reference", "response", "kind"):
            if not row[column]:
                yield table.finding(position, column, "is blank, expected as the file does not carry it")
        if row["kind"] == "record" and not row["response_unit"]:
            yield table.finding(position, "response_unit", "is blank, expected m/s2 or m/s or m or g")
    yield from _named_twice(table)


def load_findings(table: Table) -> Iterator[Finding]:
    """Check that a load test has a place, a load and an answer."""
    yield from _whole_axes(table)
    for position, row in table.sound():
        if not any(math.isfinite(row[name]) for name in POSITIONS) and not all(
            math.isfinite(row[name]) for name in ("x_mm", "y_mm", "z_mm")
        ):
            message = "neither joint angles nor x_mm, y_mm, z_mm: the row does not say where the load acted"
            yield table.finding(position, "", message, "warning")
        if not any(row[name] for name in ("fx_n", "fy_n", "fz_n")):
            yield table.finding(position, "fx_n", "the load is zero, expected a force")
        if not any(math.isfinite(row[name]) for name in ("dx_mm", "dy_mm", "dz_mm")):
            yield table.finding(position, "dx_mm", "dx_mm, dy_mm, dz_mm are all blank, expected at least one")
        elif _work(row) < 0:
            alone = "no other row loads the same place along the same line, so correct it or remove it"
            yield table.finding(position, "dx_mm", f"{AGAINST}; {alone}")
    yield from _load_units(table)


def with_their_load(table: Table) -> tuple[Table, list[Finding]]:
    """Leave out load tests whose tip moves against the load, where another test replaces each.

    Another test replaces it if it loads the same place along the same line and its tip moves with the load:
    nothing that is loaded at rest moves against its load, so that of two such tests it is known which is
    wrong. A test that nothing replaces is kept, and is an error of :func:`load_findings`.

    Returns
    -------
    The table without those rows, and a warning about each.
    """
    rows = list(table.sound())
    left_out: dict[int, int] = {}
    for position, row in rows:
        if _work(row) < 0:
            others = [at for at, other in rows if _work(other) > 0 and _loaded_alike(row, other)]
            left_out |= {position: table.rows[others[0]]} if others else {}
    warnings = [
        table.finding(
            position,
            "dx_mm",
            f"{AGAINST}; the row is left out, since row {other} loads the same place along the same line",
            "warning",
        )
        for position, other in left_out.items()
    ]
    return table.without(left_out), warnings


def _work(row: Mapping[str, Any]) -> float:
    """Return the load times the displacement along it, N mm; a component that was not read counts for 0."""
    return sum(float(row[f"f{a}_n"] * row[f"d{a}_mm"]) for a in "xyz" if math.isfinite(row[f"d{a}_mm"]))


def _loaded_alike(row: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Return whether two load tests are of one place, and their forces along one line, either way."""
    place = [name for name in row if name in (*POSITIONS, "x_mm", "y_mm", "z_mm")]
    here, there = (np.array([float(each[name]) for name in place]) for each in (row, other))
    if (row["pose"], row["point"]) != (other["pose"], other["point"]):
        return False
    first, second = (np.array([each[f"f{a}_n"] for a in "xyz"]) for each in (row, other))
    along = abs(first @ second) > ALONG * np.linalg.norm(first) * np.linalg.norm(second)
    known = np.isfinite(here).any() and np.array_equal(here, there, equal_nan=True)
    return bool(known and along)


def _load_units(table: Table) -> Iterator[Finding]:
    """Check the units of load tests by the stiffness that they make, and by the extent of the places."""
    rows = [row for _, row in table.sound()]
    yield from _radians(table)
    stiffness = [
        abs(row[f"f{axis}_n"] / row[f"d{axis}_mm"])
        for row in rows
        for axis in "xyz"
        if row[f"f{axis}_n"] and math.isfinite(row[f"d{axis}_mm"]) and row[f"d{axis}_mm"]
    ]
    typical = float(np.median(stiffness)) if stiffness else STIFFNESS_N_MM[0]
    if typical < STIFFNESS_N_MM[0]:
        hint = "fx_n … seem to be in kN, or dx_mm … in micrometres"
        yield _odd(table, "fx_n, dx_mm", typical, hint)
    if typical > STIFFNESS_N_MM[1]:
        hint = "dx_mm … seem to be in metres"
        yield _odd(table, "dx_mm", typical, hint)
    places = np.array([[row[f"{axis}_mm"] for axis in "xyz"] for row in rows]).reshape(-1, 3)
    known = places[np.isfinite(places).all(axis=1)]
    span = float(np.ptp(known, axis=0).max()) if len(known) else 0.0
    if 0 < span < CLOSEST_MM:
        fault = (
            f"all places lie within {span:g}, expected {CLOSEST_MM:g} mm or more: they seem to be in metres"
        )
        yield Finding("error", table.file, fault, column="x_mm")


def _whole_axes(table: Table) -> Iterator[Finding]:
    """Check that rows that state positions of joints state those of all, counted from 1 without a gap."""
    axes = axes_of(table.frame)
    beyond = next((name for name in stated(table.frame) if name not in axes.positions), "")
    if beyond:
        fault = f"is blank in every row, expected a number, since there is {beyond}: no axis is left out"
        yield Finding("error", table.file, fault, column=f"q{len(axes) + 1}_{beyond.rpartition('_')[2]}")
    for position, row in table.sound():
        blank = [name for name in axes.positions if math.isnan(row[name])]
        if 0 < len(blank) < len(axes):
            yield table.finding(
                position, blank[0], f"is blank, expected the positions of all {len(axes)} axes"
            )


def _radians(table: Table) -> Iterator[Finding]:
    """Report joint angles that seem to be in radians."""
    angles = np.array([[row[name] for name in TURNS] for _, row in table.sound()]).reshape(-1, len(TURNS))
    largest = float(np.nanmax(np.abs(angles))) if np.isfinite(angles).any() else 0.0
    if 0 < largest <= 2 * math.pi:
        fault = f"no angle is beyond {largest:g}: they seem to be in radians, expected degrees"
        yield Finding("error", table.file, fault, column="q1_deg")


def _odd(table: Table, column: str, typical: float, hint: str) -> Finding:
    low, high = STIFFNESS_N_MM
    fault = f"load over displacement is {typical:.3g} N/mm (median), expected {low:g} to {high:g}: {hint}"
    return Finding("error", table.file, fault, column=column)


def mass_findings(table: Table) -> Iterator[Finding]:
    """Check that a reduced mass matrix is one: positive definite."""
    yield from _whole_axes(table)
    for position, row in table.sound():
        xx, xy, xz, yy, yz, zz = (row[name] for name in ("mxx", "mxy", "mxz", "myy", "myz", "mzz"))
        if np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])[0] <= 0:
            expected = "expected the eigenvalues of a mass"
            yield table.finding(position, "mxx", f"the matrix is not positive definite, {expected}")
            continue
        mean = (xx + yy + zz) / 3
        if not MASSES_KG[0] <= mean <= MASSES_KG[1]:
            unit = "tonnes" if mean < MASSES_KG[0] else "grams"
            fault = f"found {mean:g} (mean of the diagonal), expected {MASSES_KG[0]:g} to {MASSES_KG[1]:g} kg"
            yield table.finding(position, "mxx", f"{fault}: it seems to be in {unit}")
    yield from _twice(table, ("pose", "point"))
    yield from _radians(table)


def touch_findings(table: Table) -> Iterator[Finding]:
    """Check that every touched pose has one orientation: a quaternion of length one, or three angles."""
    for position, row in table.sound():
        quaternion = np.array([row[f"q{i}"] for i in range(1, 5)])
        angles = np.array([row[f"{name}_deg"] for name in ("rx", "ry", "rz")])
        whole = [bool(np.isfinite(part).all()) for part in (quaternion, angles)]
        if sum(whole) != 1 or np.isfinite(angles).any() == np.isfinite(quaternion).any():
            fault = "expected the orientation of the flange once: q1 to q4, or rx_deg, ry_deg and rz_deg"
            yield table.finding(position, "q1", fault)
        elif whole[0] and abs(float(np.linalg.norm(quaternion)) - 1.0) > QUATERNION:
            length = float(np.linalg.norm(quaternion))
            fault = f"found a quaternion of length {length:.4g}, expected 1: scalar first, then x, y, z"
            yield table.finding(position, "q1", fault)
    places = np.array([[row[f"{axis}_mm"] for axis in "xyz"] for _, row in table.sound()]).reshape(-1, 3)
    most = float(np.abs(places).max()) if places.size else 0.0
    if 0 < most < NEAREST_MM:
        fault = f"no place is beyond {most:g}: they seem to be in metres, expected mm"
        yield Finding("error", table.file, fault, column="x_mm")


def payload_findings(table: Table) -> Iterator[Finding]:
    """Check the units of the angles, and that there are torques with and without the load."""
    yield from _radians(table)
    yield from _whole_axes(table)
    axes = axes_of(table.frame)
    for position, row in table.sound():
        lacking = [name for name in [*(axes.positions or TURNS[:1]), *axes.torques] if math.isnan(row[name])]
        if lacking:
            yield table.finding(position, lacking[0], "is blank, expected a number for each axis of the arm")
    states = {row["loaded"] for _, row in table.sound()}
    if len(states) == 1:
        fault = f'every row has "{states.pop()}", expected torques with and without the load'
        yield Finding("error", table.file, fault, column="loaded")


def published_findings(table: Table) -> Iterator[Finding]:
    """Check that a printed row holds a value."""
    for position, row in table.sound():
        if math.isnan(row["measured"]) and math.isnan(row["predicted"]):
            yield table.finding(
                position, "measured", "measured and predicted are both blank, expected at least one"
            )


def station_findings(table: Table) -> Iterator[Finding]:
    """Check that no station is tabulated twice, and that each resists a push in every direction."""
    for position, name in enumerate(table.frame["position"]):
        if name in list(table.frame["position"][:position]):
            yield table.finding(position, "position", f'position "{name}" appears twice')
    for position, row in table.sound():
        size = np.array([row[f"k{axis}_n_um"] for axis in "xyz"], dtype=float)
        across = {(a, b): row[f"k{a}{b}_n_um"] for a, b in itertools.permutations("xyz", 2)}
        push = np.diag(size)
        for (a, b), value in across.items():
            mirrored = across[b, a] if math.isnan(value) else value
            push["xyz".index(a), "xyz".index(b)] = 0.0 if math.isnan(mirrored) else mirrored
        if np.linalg.eigvalsh(0.5 * (push + push.T))[0] <= 0:
            fault = "the stiffness across is so large that the end gives way against a push"
            expected = f"expected a positive definite matrix with {', '.join(f'{k:g}' for k in size)} N/µm"
            first = next(f"k{a}{b}_n_um" for (a, b), value in across.items() if not math.isnan(value))
            yield table.finding(position, first, f"{fault}, {expected} on its diagonal: check signs and unit")


def _twice(table: Table, columns: tuple[str, ...]) -> Iterator[Finding]:
    """Report a row that is of the same thing as an earlier one."""
    first: dict[tuple[Any, ...], int] = {}
    for position, row in table.sound():
        key = tuple(row[column] for column in columns)
        other = first.setdefault(key, position)
        if any(key) and other != position:
            names = ", ".join(f'{column} "{value}"' for column, value in zip(columns, key, strict=True))
            message = f"{names} is also in row {table.rows[other]}, expected each once"
            yield table.finding(position, columns[0], message)


def _named_twice(table: Table) -> Iterator[Finding]:
    """Warn of a file that two rows name."""
    files = list(table.frame["file"])
    for position, name in enumerate(files):
        first = files.index(name)
        if name and first < position and not name.lower().endswith(SELF_DESCRIBING):
            yield table.finding(position, "file", f'"{name}" is also in row {table.rows[first]}', "warning")
