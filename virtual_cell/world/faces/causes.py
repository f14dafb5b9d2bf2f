"""What a batch of faces in the real workshop may hide: how it comes about, and what a library would call it.

Effects of the library are made from their physics and stated in its parameters: those that fit what was made
best, with the relative error that this translation has. A batch that hides one has it in place of the little
of it that is always there. Troubles have no name in any library.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from virtual_cell.hidden import Parameters, drawn_size
from virtual_cell.recipes.faces_world_draws import Workshop
from virtual_cell.units import MM, UM, Array
from virtual_cell.world.draws import either_sign
from virtual_cell.world.faces import fixture, mount, servo, swing, warmth
from virtual_cell.world.faces.finish import FaceRun
from virtual_cell.world.faces.hideable import Applied, Hideable, sized, towards, wave
from virtual_cell.world.faces.troubles import TROUBLES

_MRAD, _UM_MIN = 1e-3, UM / 60.0


def _tilted(cell: Workshop, _: list[FaceRun], p: Parameters, rng: np.random.Generator) -> Applied:
    about = (p["about_x_mrad"] * _MRAD, p["about_y_mrad"] * _MRAD)
    used = {case.wrist: cell.yaw[case.wrist] for case in cell.cases}
    tilt, error = mount.tilted(about, used, rng)
    return replace(cell, always=replace(cell.always, tilt=tilt)), error


def _warming(cell: Workshop, session: list[FaceRun], p: Parameters, _: np.random.Generator) -> Applied:
    warm, error = warmth.at_rate(cell.always.warm, p["um_per_min"] * _UM_MIN, session)
    return replace(cell, always=replace(cell.always, warm=warm)), error


def _bowed(cell: Workshop, _: list[FaceRun], p: Parameters, __: np.random.Generator) -> Applied:
    entries = (p["xx_um"] * UM, p["xy_um"] * UM, p["yy_um"] * UM)
    bow, error = fixture.bending(cell.always.bow, entries, cell.size)
    return replace(cell, always=replace(cell.always, bow=bow)), error


def _drooping(cell: Workshop, session: list[FaceRun], p: Parameters, rng: np.random.Generator) -> Applied:
    made, error = servo.decaying(rng, p["amplitude_um"] * UM, p["length_mm"] * MM, session)
    return replace(cell, always=replace(cell.always, servo=made)), error


def _swinging(cell: Workshop, _: list[FaceRun], p: Parameters, rng: np.random.Generator) -> Applied:
    made = swing.drawn(rng, p["frequency_hz"], p["amplitude_um"] * UM)
    return replace(cell, troubles=(*cell.troubles, made)), made.impurity


def _softened(cell: Workshop, session: list[FaceRun], p: Parameters, rng: np.random.Generator) -> Applied:
    """Let drives hold otherwise in the cut than brakes or idle drives do in the load tests, joint by joint.

    Base, bracket and structural modes stay as they are. The factor of the library is that of the tip: the one
    that fits the height under the forces of the session best.
    """
    apart = np.exp(rng.normal(0.0, 0.08, 6))
    at = fixture.grid(cell.size)[::60]
    forces = {(run.wrist, run.location): _middle(run) for run in session}
    joints = cell.arm.joints_alone
    changed = replace(joints, stiffness=joints.stiffness * apart)
    parts = []
    for (wrist, location), force in forces.items():
        pose, place = cell.poses[f"{wrist}{location}"], cell.places[f"{wrist}{location}"]
        given = (pose.tested, place.compliance(joints, cell.size), place.compliance(changed, cell.size))
        parts.append([compliance(at)[:, 2] @ force for compliance in given])
    tests, alone, loose = np.concatenate(parts, axis=1)
    rigid = tests - alone
    # Least squares over all places: tests · (rigid + loose/common) / tests² = 1/factor.
    wanted = float(tests @ tests) / p["factor"] - float(tests @ rigid)
    common = float(tests @ loose) / wanted
    in_cut = replace(cell.arm, stiffness=cell.arm.stiffness * apart * common)
    poses = {
        name: replace(pose, in_cut=cell.places[name].compliance(in_cut, cell.size))
        for name, pose in cell.poses.items()
    }
    rest = (rigid + loose / common) * p["factor"] - tests
    return replace(cell, poses=poses), float(np.sqrt(rest @ rest / (tests @ tests)))


def _middle(run: FaceRun) -> Array:
    return np.asarray(run.force(np.array([0.5 * run.passes.length]))[0])


def _unplaced(cell: Workshop) -> bool:
    return cell.scanner.place != "declared"


def _tilt(rng: np.random.Generator, cell: Workshop) -> Parameters:
    shown = (0.3 if _unplaced(cell) else 0.6) * cell.milling.tool.radius / MM
    return towards(rng, "about_x_mrad about_y_mrad", sized(rng, cell, shown, 10.0))


def _growth(rng: np.random.Generator, cell: Workshop) -> Parameters:
    # Without a declared place the tilt of the whole face, which is most of a growth, is not compared.
    return {"um_per_min": sized(rng, cell, 0.06 if _unplaced(cell) else 0.45, 230.0)}


def _vibration(rng: np.random.Generator, cell: Workshop) -> Parameters:
    return {"frequency_hz": wave(rng, cell, 8.0, 70.0), "amplitude_um": sized(rng, cell, 0.22, 145.0)}


def _droop(rng: np.random.Generator, cell: Workshop) -> Parameters:
    amplitude = either_sign(rng) * sized(rng, cell, 0.09, 350.0)
    return {"amplitude_um": amplitude, "length_mm": drawn_size(rng, 8.0, 40.0)}


def _factor(rng: np.random.Generator, cell: Workshop) -> Parameters:
    size = sized(rng, cell, 10.0 if _unplaced(cell) else 30.0, 0.75)
    return {"factor": float(round(math.exp(either_sign(rng) * size), 3))}


LIBRARY: Mapping[str, Hideable] = {
    "spindle_tilt": Hideable("about_x_mrad about_y_mrad", _tilt, _tilted),
    "thermal_growth": Hideable("um_per_min", _growth, _warming),
    "fixture_bow": Hideable(
        "xx_um xy_um yy_um",
        lambda r, c: towards(r, "xx_um xy_um yy_um", sized(r, c, 0.131, 410.0)),
        _bowed,
    ),
    "path_vibration": Hideable("frequency_hz amplitude_um", _vibration, _swinging),
    "entry_transient": Hideable("amplitude_um length_mm", _droop, _drooping),
    "stiffness_scale": Hideable("factor", _factor, _softened),
}
FACE_CAUSES: Mapping[str, Hideable] = {**LIBRARY, **TROUBLES}


def applied(
    cell: Workshop, session: list[FaceRun], hidden: Mapping[str, Parameters | None], rng: np.random.Generator
) -> tuple[Workshop, dict[str, Parameters], dict[str, float]]:
    """Hide what is asked for (parameters as given, or None: drawn).

    Returns
    -------
    The cell that hides it, the parameters by name, and by name the relative errors of translations.

    Raises
    ------
    KeyError
        For something that is not known.
    """
    effects = {name: given or FACE_CAUSES[name].draw(rng, cell) for name, given in hidden.items()}
    errors = {}
    for name, values in effects.items():
        cell, errors[name] = FACE_CAUSES[name].apply(cell, session, values, rng)
    return cell, effects, {name: round(error, 3) for name, error in errors.items() if error > 0.0}
