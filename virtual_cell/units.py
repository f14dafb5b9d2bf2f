"""Factors to SI and the array type of the simulator."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.floating[Any]]

MM = 1e-3
UM = 1e-6
MS = 1e-3
DEG = math.pi / 180.0
RPM = 2.0 * math.pi / 60.0
N_MM2 = 1e6
N_MM = 1e3
N_UM = 1e6
