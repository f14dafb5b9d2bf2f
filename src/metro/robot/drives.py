"""What the motors' currents are at the joints: drive constants, gear ratios and their uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from metro.units import JSON, Array

# Relative standard uncertainty of a drive constant of which only its nominal value is known, from rectangular
# distributions (JCGM 100:2008, 4.3.7): ±10 % tolerance of torque constants in motor catalogues; ±6 % for
# magnets that lose 0.1 to 0.2 % of their flux per kelvin over 40 K of warming; ±13 % for strain wave and
# cycloidal gears, whose efficiency lies between 0.65 and 0.9. One make of motor and gear shares all three.
PARTS = (0.10, 0.06, 0.13)
NOMINAL = round(math.sqrt(sum(part**2 for part in PARTS) / 3.0), 2)
ASSUMED = (
    f"{100 * NOMINAL:.0f} % standard uncertainty, shared by all joints: none is declared as "
    "drives.uncertainty of the cell. Assumed are rectangular distributions of ±10 % (motor constant), "
    "±6 % (magnets over 40 K) and ±13 % (gear efficiency)"
)


@dataclass(frozen=True, eq=False)
class Drives:
    """The drives of n joints.

    Attributes
    ----------
    constant : (n,) torque at the joint per ampere of the log, N m/A; NaN where it is not known.
    covariance : (n, n) of the relative errors of the constants, or of torques that the controller logged.
    source : where the uncertainty is from, in words.
    """

    constant: Array
    covariance: Array
    source: str

    @property
    def relative(self) -> Array:
        """Relative standard uncertainty of each joint's torque, (n,)."""
        return np.sqrt(np.diag(self.covariance))


def drives_of_cell(cell: JSON, count: int) -> Drives:
    """Return the drives of a cell of ``count`` joints, from its section ``drives``.

    A constant belongs to the motor's shaft where ``gear_ratio`` is given, else to the joint. ``uncertainty``
    is of an error that all joints share, ``uncertainty_by_joint`` of errors of their own.
    """
    given = cell.get("drives") or {}
    constant = np.full(count, np.nan)
    if given.get("torque_per_ampere_nm_a") is not None:
        ratio = np.asarray(given.get("gear_ratio", np.ones(count)), dtype=float)
        constant = np.asarray(given["torque_per_ampere_nm_a"], dtype=float) * ratio
    if not declared(cell):
        return Drives(constant, np.full((count, count), NOMINAL**2), ASSUMED)
    shared = float(given.get("uncertainty", 0.0))
    own = np.asarray(given.get("uncertainty_by_joint", np.zeros(count)), dtype=float)
    words = [f"{100 * shared:.2g} % standard uncertainty shared by all joints"] if shared else []
    if own.any():
        parts = " to ".join(f"{100 * part:.2g}" for part in np.unique([own.min(), own.max()]))
        words.append(f"{parts} % of each joint's own")
    source = f"{' and '.join(words) or 'no uncertainty'}, as drives of the cell states"
    return Drives(constant, shared**2 + np.diag(own**2), source)


def declared(cell: JSON) -> bool:
    """Return whether a cell states the uncertainty of its drives."""
    return bool({"uncertainty", "uncertainty_by_joint"} & set(cell.get("drives") or {}))
