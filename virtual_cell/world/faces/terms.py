"""What is always there of the library's effects in a batch of faces, in the contract's terms.

Each thing is seen by itself: what it does to the faces of the session, on a grid, cut by a tip that does not
give way. Its form is read with the noise of the means over discs; how high a face lies and how it is tilted,
against the mean of all, is read where the place of the scans is declared, with what differs between scans.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from virtual_cell.hidden import Parameters
from virtual_cell.recipes.faces_world_draws import Workshop
from virtual_cell.units import MM, UM, Array
from virtual_cell.world.draws import digits
from virtual_cell.world.faces import fixture
from virtual_cell.world.faces.finish import Cause, Cutting, FaceRun, Influence, finished, over_plate
from virtual_cell.world.faces.hideable import disc_noise
from virtual_cell.world.present import Term, term

_EVERY = 7  # of the points of the grid: enough for an rms
_LENGTHS = np.geomspace(2.0, 150.0, 60) * MM  # of a transient, among which the best one is
_DISC = 11.0 * MM  # about what one mean is taken over
_MRAD = 1e-3


def in_contract_terms(cell: Workshop, session: Sequence[FaceRun]) -> dict[str, list[Term]]:
    """Return, by the contract's names, what there is of each effect in the faces of a session."""
    return {
        "spindle_tilt": [_tilt(cell, session)],
        "thermal_growth": [_growth(cell, session)],
        "fixture_bow": [_bow(cell, session)],
        "entry_transient": [_entry(cell, session)],
        "stiffness_scale": [_stiffness(cell, session)],
    }


def done_by(cell: Workshop, cause: Cause | None, session: Sequence[FaceRun]) -> Array:
    """Height (faces, n), m, that a cause alone leaves on the grid of each face."""
    points = _grid(cell)
    rng = np.random.default_rng(0)
    influences = [cause.in_face(run, rng) if cause else Influence() for run in session]
    return np.array([_finished(run, one, points) for run, one in zip(session, influences, strict=True)])


def parted(cell: Workshop, faces: Array) -> tuple[Array, Array]:
    """Return form (m, n), m, of faces on the grid, and their planes (m, 3): height, m, and slopes."""
    points = _grid(cell)
    plane = np.column_stack([np.ones(len(points)), points - np.array(cell.size) / 2.0])
    found = np.linalg.lstsq(plane, faces.T, rcond=None)[0]
    return np.asarray(faces - (plane @ found).T), np.asarray(found.T)


def _grid(cell: Workshop) -> Array:
    return fixture.grid(cell.size)[::_EVERY]


def _finished(run: FaceRun, influence: Influence, points: Array) -> Array:
    ends = np.array([-run.passes.lead, run.passes.length + run.passes.lead])
    rigid = [(ends, np.zeros(2)) for _ in run.passes.axes]
    return finished(run, 0.0, rigid, [influence], points)


@dataclass(frozen=True)
class _Alone:
    """A cause that is a height and no more, the same in every face."""

    height: Callable[[Cutting], Array]

    def in_face(self, run: FaceRun, rng: np.random.Generator) -> Influence:
        """Return the height."""
        del run, rng
        return Influence(height=self.height)


def _term(cell: Workshop, parameters: Parameters, does: Array, told: Array) -> Term:
    (form, planes), (told_form, told_planes) = parted(cell, does), parted(cell, told)
    discs = len(does) * cell.size[0] * cell.size[1] / _DISC**2
    in_form = term(parameters, form, told_form, disc_noise(cell), discs)
    if cell.scanner.place != "declared":
        return in_form
    height, turn = cell.scanner.again
    lie, told_lie = ((one - one.mean(axis=0)) / [height, turn, turn] for one in (planes, told_planes))
    return max(in_form, term(parameters, lie, told_lie, 1.0, lie.size), key=lambda one: one.gain)


def _tilt(cell: Workshop, session: Sequence[FaceRun]) -> Term:
    """Take the mean over the faces: the mount of one wrist may not be that of another."""
    about = np.mean([cell.always.tilt.tilt(run.wrist) for run in session], axis=0)
    mean = _Alone(lambda cutting: cutting.offset @ np.array([-about[1], about[0]]))
    names = ("about_x_mrad", "about_y_mrad")
    parameters = {name: digits(float(v) / _MRAD) for name, v in zip(names, about, strict=True)}
    does, told = (done_by(cell, one, session) for one in (cell.always.tilt, mean))
    return _term(cell, parameters, does, told)


def _growth(cell: Workshop, session: Sequence[FaceRun]) -> Term:
    warm, times = cell.always.warm, np.linspace(0.0, max(run.duration for run in session) + 1.0, 400)
    rate, curve = float(np.mean([warm.at_first(run) for run in session])), warm.mean(session, times)
    alike = _Alone(lambda at: -np.interp(at.t, times, curve))
    does, told = (done_by(cell, one, session) for one in (warm, alike))
    return _term(cell, {"um_per_min": digits(rate / UM * 60.0)}, does, told)


def _bow(cell: Workshop, session: Sequence[FaceRun]) -> Term:
    points = _grid(cell)
    steady = replace(cell.always.bow, repeat=0.0)
    entries, _ = fixture.second_degree(steady.shape(points, cell.size), points, cell.size)
    u, v = over_plate(points, cell.size)
    form = np.column_stack([u * u, u * v, v * v]) @ entries
    does, told = done_by(cell, steady, session), np.tile(form, (len(session), 1))
    names = ("xx_um", "xy_um", "yy_um")
    parameters = {name: digits(float(v) / UM) for name, v in zip(names, entries, strict=True)}
    return _term(cell, parameters, does, told)


def _entry(cell: Workshop, session: Sequence[FaceRun]) -> Term:
    """Take the decay that is closest to the droop of the drives, over the passes of all faces."""
    droops = [cell.always.servo.droop(run) for run in session]
    inside = [(s >= 0.0) & (s <= run.passes.length) for (s, _), run in zip(droops, session, strict=True)]
    s = np.concatenate([one[0][some] for one, some in zip(droops, inside, strict=True)])
    z = np.concatenate([one[1][some] for one, some in zip(droops, inside, strict=True)])
    shapes = np.exp(-s / _LENGTHS[:, None])
    sizes = (shapes @ z) / (shapes**2).sum(axis=1)
    best = int(np.argmin(((z - sizes[:, None] * shapes) ** 2).sum(axis=1)))
    amplitude, length = float(sizes[best]), float(_LENGTHS[best])
    decay = _Alone(lambda cutting: amplitude * np.exp(-np.maximum(cutting.s, 0.0) / length))
    does, told = (done_by(cell, one, session) for one in (cell.always.servo, decay))
    parameters = {"amplitude_um": digits(amplitude / UM), "length_mm": digits(length / MM)}
    return _term(cell, parameters, does, told)


def _stiffness(cell: Workshop, session: Sequence[FaceRun]) -> Term:
    """Tell the error of the load cell: tests that were pulled harder than was read show too soft a tip.

    It is exact: what gives way in the cut is a tested tip over ``1 + gain``.
    """
    points = _grid(cell)
    faces = []
    for run in session:
        force = run.force(np.array([0.5 * run.passes.length]))[0]
        faces.append(cell.poses[f"{run.wrist}{run.location}"].tested(points)[:, 2] @ force)
    tip = np.array(faces)
    factor = 1.0 + cell.loads.gain
    does = tip * (1.0 - factor)
    return _term(cell, {"factor": round(factor, 4)}, does, does)
