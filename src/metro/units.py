"""The factors between the units of files and manifests and SI: the one place where they are written down.

A value from a file times its factor is SI; an SI value divided by its factor is what a file holds.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]
JSON = dict[str, Any]

MM = 1e-3
UM = 1e-6
MS = 1e-3
DEG = math.pi / 180.0
ARCSEC = DEG / 3600.0
MRAD = 1e-3
URAD = 1e-6
RPM = 2.0 * math.pi / 60.0
N_MM2 = 1e6
N_MM = 1e3
N_UM = 1e6

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
PRINTED = {
    "1": "",
    "um": "µm",
    "deg": "°",
    "mdeg": "m°",
    "urad": "µrad",
    "N/mm2": "N/mm²",
    "N mm2": "N mm²",
    "kg m2": "kg m²",
    "ms2": "ms²",
    "um/min": "µm/min",
    "N/um": "N/µm",
    "N*m/rad": "N m/rad",
    "N m/rad3": "N m/rad³",
}


def printed(unit: str | None) -> str:
    """Return a unit of the outputs as it is printed: µm for um, nothing for 1."""
    return PRINTED.get(unit or "", unit or "")


def printed_name(name: str, unit: str | None = "") -> str:
    """Return the name of a quantity as words, without the unit that it ends in: radius_um → radius."""
    tail = "_" + (unit or "").replace("/", "_").replace(" ", "_").lower()
    return (name[: -len(tail)] if unit and name.lower().endswith(tail) else name).replace("_", " ")
