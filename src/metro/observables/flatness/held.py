"""What of a load does not move the tip: friction in the gears holds it back, lost motion adds to it.

Load tests are made with far larger forces than cuts, and few newtons that are not in proportion to the load
are a large share of a cut's deflection. The tests themselves show them as the intercept of force over
displacement, as well as their scatter allows.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from metro.observables.flatness.pose_field import PoseField
from metro.surface.tip_stiffness import Rows

# Of the largest load: as the lost motion of the joints of an arm, of which makers state 1 to 8 %.
LOST = 0.04


def held_back(field: PoseField, rows: Rows, noise: float) -> float:
    """Force in newtons, root mean square, by which a load may differ from what moves the tip.

    Displacements are C (F - h F/|F|) with h believed to be 0 within ``LOST`` of the largest load, beforehand.

    Parameters
    ----------
    noise : standard deviation of a displacement, m.
    """
    size = np.linalg.norm(rows.force, axis=1)
    design = rows.design(field.basis)[:, field.used]
    compliance = np.linalg.lstsq(design, rows.displacement)[0]
    towards = replace(rows, force=rows.force / np.maximum(size, 1e-9)[:, None]).design(field.basis)[
        :, field.used
    ]
    held = -(towards @ compliance)
    share, _, _, _ = np.linalg.lstsq(design, np.column_stack([held, rows.displacement]))
    # Only what is not confounded with the compliance says how large h is; beforehand it is 0, within LOST.
    seen, left = (np.column_stack([held, rows.displacement]) - design @ share).T
    precision = float(seen @ seen) / noise**2 + 1.0 / (LOST * float(size.max())) ** 2
    mean = float(seen @ left) / noise**2 / precision
    return math.hypot(mean, precision**-0.5)
