"""What is always there of the library's effects at a machine, in the contract's terms.

How far each moves the boundary is judged by the mean of the cut over a turn, closed with the delay of a
tooth: enough to tell what is nothing. The tests themselves are marched.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from virtual_cell.hidden import Parameters
from virtual_cell.units import DEG, RPM, Array
from virtual_cell.world.boundary.cell import Cell
from virtual_cell.world.boundary.effects import told as in_terms
from virtual_cell.world.boundary.resonances import state_matrices
from virtual_cell.world.draws import digits
from virtual_cell.world.present import Term, term

Complex = npt.NDArray[np.complex128]
_LINES = 5200  # frequencies at which a boundary is looked for
_ANGLES = 90
_OTHER = 0.06  # relative change of a frequency that no change of stiffness makes
_DEEPEST = 8.0  # times the lowest boundary: nobody goes deeper
_NEVER_FREE = 1.0  # m, by which work would spring back


@dataclass(frozen=True, eq=False)
class Climbs:
    """Ladders of tests: ``rpm`` (c,), ``direction`` (c,), and the ``ratio`` of the depths of two rungs.

    ``turns``: of the spindle that are recorded, from which a frequency of chatter can be read; 0: none.
    """

    rpm: Array
    direction: tuple[str, ...]
    ratio: float
    turns: int


def in_contract_terms(cell: Cell, climbs: Climbs) -> dict[str, list[Term]]:
    """Return, by the contract's names, what there is of each effect at a machine."""
    s = cell.session
    rung = math.log(climbs.ratio) / math.sqrt(12.0)
    in_depth = math.hypot(rung, s.depth_sd / cell.level, s.common, s.drift)

    def seen(parameters: Parameters, bare: Cell, told: Cell) -> Term:
        less, does, made = (np.log(boundary(one, climbs)) for one in (bare, cell, told))
        moved, told_moved = (_apart(one[0] - less[0]) for one in (does, made))
        by_depth = term(parameters, moved, told_moved, in_depth, len(climbs.rpm))
        if not climbs.turns:
            return by_depth
        line = climbs.rpm / 60.0 / climbs.turns / np.exp(less[1])  # of a spectrum, its width over its place
        # A frequency is anywhere within a line, as a boundary is between two rungs, and moves by half of what
        # the stiffness does while the machine warms.
        in_hz = np.hypot(line, 0.5 * s.warming) / math.sqrt(12.0)
        same = np.abs(does[1] - less[1]) < _OTHER  # at others it is another resonance that rings
        if not same.any():
            return by_depth
        rings, told_rings = (((one[1] - less[1]) / in_hz)[same] for one in (does, made))
        by_hz = term(parameters, rings, told_rings, 1.0, int(same.sum()))
        return max(by_depth, by_hz, key=lambda one: one.gain)

    return {
        "process_damping": [seen(*_flank(cell, climbs.rpm))],
        "spindle_speed_softening": [seen(*_bearings(cell, climbs.rpm))],
        "mode_coupling": [seen(*_headings(cell))],
    }


def _apart(shift: Array) -> Array:
    """Leave out what moves all boundaries alike: coefficients are not known so well."""
    return np.asarray(shift - shift.mean())


Told = tuple[Parameters, Cell, Cell]  # parameters, the cell without the thing, the cell that they describe


def _flank(cell: Cell, rpm: Array) -> Told:
    """Tell a wear land by the force of its slope alone: it never comes free of the work, and does not rub."""
    told, _ = in_terms("process_damping", cell, {}, rpm)
    none = replace(cell.flank, land=0.0)
    alike = replace(cell.flank, friction=0.0, springback=_NEVER_FREE)
    return told, replace(cell, flank=none), replace(cell, flank=alike)


def _bearings(cell: Cell, rpm: Array) -> Told:
    """Tell bearings by a change of all stiffness alike, in proportion to the speed."""
    told, _ = in_terms("spindle_speed_softening", cell, {}, rpm)
    rigid = replace(cell.spindle, bearing=0.0)
    alike = replace(cell.resonances, bearing=np.ones(len(cell.resonances.hz)))
    at_fastest = told["change_per_krpm"] * cell.fast / 1000.0
    straight = replace(cell.spindle, bearing=at_fastest, bent=1.0)
    return told, replace(cell, spindle=rigid), replace(cell, spindle=straight, resonances=alike)


def _headings(cell: Cell) -> Told:
    """Tell lines that are each off the flats by their mean, weighed by their compliance."""
    r = cell.resonances
    off = np.mod(r.heading - cell.flats + math.pi / 4.0, math.pi / 2.0) - math.pi / 4.0
    mean = float(np.average(off, weights=1.0 / r.stiffness))
    straight = replace(r, heading=r.heading - off)
    return (
        {"angle_deg": digits(mean / DEG)},
        replace(cell, resonances=straight),
        replace(cell, resonances=straight.turned(mean)),
    )


def boundary(cell: Cell, climbs: Climbs) -> Array:
    """Depth, m, and frequency, Hz, at which each speed begins to chatter, by the mean of the cut: (2, c)."""
    middle = np.full(len(climbs.rpm), 0.5)
    a, b, c = state_matrices(
        cell.resonances,
        cell.stiffer(climbs.rpm, middle),
        1.0 + cell.spindle.damped * climbs.rpm / cell.fast,
        np.zeros(len(climbs.rpm)),
    )
    hz = np.linspace(0.6 * cell.resonances.hz.min(), 1.7 * cell.resonances.hz.max(), _LINES)
    s = 2j * math.pi * hz
    found = []
    for one, rpm, way in zip(a, climbs.rpm, climbs.direction, strict=True):
        felt = c @ np.linalg.solve(s[:, None, None] * np.eye(len(one)) - one, b)
        found.append(_lowest(cell, s, np.asarray(felt, dtype=np.complex128), rpm, way))
    return np.array(found).T


def _lowest(cell: Cell, s: Complex, felt: Complex, rpm: float, direction: str) -> tuple[float, float]:
    """Lowest depth, m, at which a vibration e^{st} neither grows nor fades, its loop is one; and its Hz."""
    surface_speed = rpm * RPM * 0.5 * cell.tool.diameter
    chip, land = _mean_cut(cell, direction, surface_speed)
    again = 1.0 - np.exp(-s * 60.0 / rpm / cell.tool.teeth)
    loop = felt @ (again[:, None, None] * chip + (s / surface_speed)[:, None, None] * land)
    found = [(_DEEPEST * cell.level, 1.0)]
    hz = s.imag / (2.0 * math.pi)
    for depth in _followed(np.asarray(1.0 / np.linalg.eigvals(loop), dtype=np.complex128)).T:
        steady = np.abs(np.diff(depth)) < 0.5 * np.abs(depth[1:])  # else it has jumped to the other value
        turns = np.flatnonzero(steady & (depth.imag[1:] * depth.imag[:-1] < 0.0))
        share = depth.imag[turns] / (depth.imag[turns] - depth.imag[turns + 1])
        real = depth.real[turns] + share * (depth.real[turns + 1] - depth.real[turns])
        at = hz[turns] + share * (hz[turns + 1] - hz[turns])
        found += [(float(d), float(f)) for d, f in zip(real, at, strict=True) if d > 0.0]
    return min(found)


def _followed(pairs: Complex) -> Complex:
    """Put pairs (n, 2) of values in the order in which each goes on from the one before."""
    on = np.abs(np.diff(pairs, axis=0)).sum(axis=1)
    crossed = np.abs(pairs[1:, ::-1] - pairs[:-1]).sum(axis=1)
    swapped = np.concatenate([[0], np.cumsum(crossed < on) % 2])
    return np.where(swapped[:, None] == 1, pairs[:, ::-1], pairs)


def _mean_cut(cell: Cell, direction: str, surface_speed: float) -> tuple[Array, Array]:
    """Force on the tool per depth, (2, 2), N/m, by the thickness of the chip and by the slope of the edge."""
    law, flank = cell.law, cell.flank
    entry, leave = cell.immersion(direction)
    angle = entry + (np.arange(_ANGLES) + 0.5) * (leave - entry) / _ANGLES
    out = np.stack([np.sin(angle), np.cos(angle)])
    along = np.stack([-np.cos(angle), np.sin(angle)])
    share = cell.tool.teeth * (leave - entry) / (2.0 * math.pi) / _ANGLES
    chip = (law.ktc * along - law.krc * out) @ out.T * share
    if flank.land == 0.0:
        return chip, np.zeros((2, 2))
    slope = cell.feed / 3.0 * 2.0 * math.pi * float(cell.resonances.hz.min()) / surface_speed
    pressed = flank.viscous * (1.0 + 0.5 * flank.growth) ** 2 * flank.effective(slope)
    return chip, pressed * ((flank.friction * along - out) @ out.T) * share
