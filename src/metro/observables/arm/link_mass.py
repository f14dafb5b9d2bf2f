"""The mass of the tip from the masses of the links, beside the one that mass.csv declares ([F] eq. 4).

Table ``tip_mass``: a row per point of mass.csv, entry of the matrix, and way to it.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.batch.processed import Tables
from metro.observables.arm.load_tests import joint_places
from metro.robot.kinematics import arm_of_cell
from metro.robot.link_mass import links_of_cell, mass_about_base, tip_mass
from metro.units import JSON, Array

ENTRIES = {"mxx": (0, 0), "mxy": (0, 1), "mxz": (0, 2), "myy": (1, 1), "myz": (1, 2), "mzz": (2, 2)}


def link_masses(batch: Batch, read: Tables, identified: JSON) -> dict[str, pd.DataFrame]:
    """Return the table ``tip_mass``; no table where the cell has no links or no point has joint angles.

    Returns
    -------
    Columns ``pose, point``, ``way`` (declared; links: with their kinetic energy as the joints yield, or least
    where the stiffness of the joints is not known; equation 4), the six entries in kg, and
    ``difference_percent`` of declared (Frobenius; the declared matrix less this one).
    """
    arm, links = arm_of_cell(batch.cell, batch.manifest), links_of_cell(batch.cell)
    if arm is None or not links:
        return {}
    mass = read("mass").dropna(subset=arm.axes.positions)
    if mass.empty:
        return {}
    q = joint_places(mass, arm)
    compliance = _joint_compliance(batch, identified)
    ways = {"declared": _declared(mass)}
    try:
        by_links = tip_mass(arm, q, links, compliance)
        ways["links, static" if compliance is not None else "links, least"] = by_links
    except ValueError as reason:
        return {"tip_mass_refused": pd.DataFrame({"reason": [str(reason)]})}
    ways["equation 4"] = mass_about_base(arm, q, links)
    rows = []
    for place, (pose, point) in enumerate(zip(mass["pose"], mass["point"], strict=True)):
        own = ways["declared"][place]
        for way, matrices in ways.items():
            matrix = matrices[place]
            share = float(np.linalg.norm(own - matrix) / np.linalg.norm(own))
            entries = {name: float(matrix[at]) for name, at in ENTRIES.items()}
            head = {"pose": pose, "point": point, "way": way}
            rows.append(head | entries | {"difference_percent": 100 * share})
    return {"tip_mass": pd.DataFrame(rows)}


def _declared(mass: pd.DataFrame) -> Array:
    matrices = np.zeros((len(mass), 3, 3))
    for name, (i, j) in ENTRIES.items():
        matrices[:, i, j] = matrices[:, j, i] = mass[name].to_numpy(dtype=float)
    return matrices


def _joint_compliance(batch: Batch, identified: JSON) -> Array | None:
    """Compliances of the joints (6,), rad/(N m), identified or declared; None if one of them is not known."""
    block = (identified.get("arm") or {}).get("joint_stiffness")
    values = [q.get("value") for q in block] if block else batch.cell.get("joint_stiffness_nm_rad")
    return 1.0 / np.asarray(values, dtype=float) if values and all(values) else None
