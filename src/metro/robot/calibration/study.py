"""The calibration of an arm by one series of poses: geometry, effects, and errors on what was left out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from metro.robot.calibration.determined import Determined, determined
from metro.robot.calibration.effects import Effect, library
from metro.robot.calibration.fit import Fit, columns, fitted, predicted
from metro.robot.calibration.held_out import HeldOut, held_out
from metro.robot.calibration.measured import seen, seen_of_geometry
from metro.robot.calibration.model import BASE, free_of_geometry, jacobian
from metro.robot.calibration.poses import Poses
from metro.robot.calibration.search import Found, search
from metro.robot.calibration.start import nominal
from metro.robot.kinematics import Geometry
from metro.units import MM

FEWEST = 40  # poses: without a quarter, 90 coordinates for the 27 parameters of a six-axis arm
MOST = 15_000  # poses of a fit, of more every so many: their derivatives take some 100 MB
STAGES = ("nominal", "geometry", "effects")


@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated arm.

    Attributes
    ----------
    fits : of the nominal geometry (base and tool free), of its corrections, and of these with the effects.
    determined : what the poses determine of the geometry. found : the search for effects.
    """

    fits: tuple[Fit, Fit, Fit]
    determined: Determined
    found: Found

    @property
    def final(self) -> Fit:
        """The arm with its effects."""
        return self.fits[-1]


def calibrated(poses: Poses, geometry: Geometry) -> Calibration:
    """Calibrate an arm by at most :data:`MOST` poses.

    Raises
    ------
    ValueError
        Where the poses do not determine even the place of the base, or those of the stations.
    """
    poses = poses.thinned(MOST)
    as_declared, up = nominal(poses, geometry)
    state = as_declared.state
    at, derivatives = jacobian(state, poses.q, poses.point)
    shown = seen_of_geometry(state, at, poses, derivatives)
    known = determined(shown, free_of_geometry(state), as_declared.scale, state.head)
    stations = slice(state.head - state.stations.size, state.head)
    placed, what = (
        (known.kept[stations], "the places of the stations")
        if poses.by_distance
        else (known.kept[: len(BASE)], "the place of the arm's base")
    )
    if not placed.all():
        scatter = f"they scatter by {as_declared.scale / MM:.3g} mm about the declared arm"
        raise ValueError(f"the poses do not determine {what}: {scatter}")
    corrected = fitted(poses, state, known.kept)
    found = search(poses, corrected, library(poses, state, up))
    return Calibration(
        (as_declared, corrected, fitted(poses, state, known.kept, found.effects)), known, found
    )


def left_out(poses: Poses, geometry: Geometry) -> tuple[HeldOut, ...]:
    """Calibrate anew without each part of the poses, choice of effects included, and predict that part."""
    return held_out(poses, lambda some: calibrated(some, geometry).fits)


@dataclass(frozen=True)
class Size:
    """How much an effect moves the point or changes its distance, rms over poses, m; standard deviation."""

    effect: Effect
    moves: float
    sd: float


def sizes(fit: Fit, poses: Poses) -> tuple[Size, ...]:
    """Return how much each effect moves the point, less what corrections of the geometry would do alike."""
    place, q = predicted(fit.state, fit.effects, fit.values, poses)
    _, derivatives = jacobian(fit.state, q, poses.point)
    shown = seen_of_geometry(fit.state, place, poses, derivatives)[..., fit.free]
    geometry, _ = np.linalg.qr(shown.reshape(-1, shown.shape[-1]))
    found = []
    for at, part in enumerate(columns(fit.state, derivatives, fit.effects, poses)):
        own = seen(fit.state, place, poses, part).reshape(len(geometry), -1)
        own = own - geometry @ (geometry.T @ own)
        form = own.T @ own / len(poses)
        values, covariance = fit.values[at], fit.covariance[fit.place(at), fit.place(at)]
        moves = float(np.sqrt(values @ form @ values))
        slope = form @ values / moves if moves else np.zeros_like(values)
        found.append(Size(fit.effects[at], moves, float(np.sqrt(slope @ covariance @ slope))))
    return tuple(found)
