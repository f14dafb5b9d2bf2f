"""The table ``stations`` as arrays: places and stiffness matrices of a tabulated machine."""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd

from metro.robot.stations import Stations
from metro.units import MM, N_UM, Array

AXES = "xyz"
PLACE = [f"{axis}_mm" for axis in AXES]
STIFFNESS = [f"k{axis}_n_um" for axis in AXES]
ENTRIES = [f"k{a}{b}_n_um" for a, b in itertools.product(AXES, AXES)]  # of the matrix, row by row


def stations_of(table: pd.DataFrame) -> Stations:
    """Return places and stiffness matrices of the rows of ``stations``.

    Of the stiffness across, one of a pair that is blank is as the other, and zero where both are: a structure
    without follow-up forces resists alike (Maxwell and Betti).
    """
    known = table.reindex(columns=ENTRIES).to_numpy(float).reshape(-1, 3, 3)
    matrix = np.nan_to_num(np.where(np.isnan(known), np.swapaxes(known, 1, 2), known))
    matrix[:, range(3), range(3)] = table[STIFFNESS].to_numpy(float)
    return Stations(table[PLACE].to_numpy(float) * MM, matrix * N_UM)


def entries(matrix: Array) -> dict[str, float]:
    """Return the entries, N/µm, of a stiffness matrix (3, 3), N/m, as columns of a table."""
    return dict(zip(ENTRIES, (matrix / N_UM).ravel().tolist(), strict=True))
