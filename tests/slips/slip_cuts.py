"""Force records of slots and side cuts whose bookkeeping is known, made with the model's own basis."""

from dataclasses import replace

import numpy as np

from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import engagement
from metro.cutting.force import Cut
from metro.observables.force.dynamometer import Recording
from metro.observables.force.model import ForceSetting
from metro.slips.waveform import Record, design

BETA = np.array([850e6, 320e6, 180e6, 15e3, 18e3, 4e3])
CUTTER = Cutter(6e-3, np.radians(30.0), evenly_pitched(3))
SENSOR = {"reads": "work", "axes": {"x": "x", "y": "y", "z": "z"}, "rotation_deg": 0.0}
CUTS = (
    ("slot", "slot", 0.05),
    ("slot", "slot", 0.1),
    ("side", "up", 0.06),
    ("side", "up", 0.12),
    ("side", "down", 0.06),
    ("side", "down", 0.12),
)


def setting(operation, direction, feed_mm):
    arc = engagement(operation, direction, 4e-3, CUTTER.radius)
    recording = Recording((0.5,), 1.0, 100.0, 0.0, 0.0, 0.0)
    return ForceSetting(Cut(feed_mm * 1e-3, 2e-3, arc), 0.0, 24, recording, 0.0)


def records(cutter=CUTTER, noise=0.5, seed=1, beta=BETA):
    """One record of each cut, its start at any phase, with ``noise`` N in every order."""
    rng = np.random.default_rng(seed)
    made = []
    for i, cut in enumerate(CUTS):
        basis = design(cutter, setting(*cut)).basis @ beta
        turned = basis * np.exp(1j * rng.uniform(0.0, 2.0 * np.pi) * np.arange(len(basis)))[:, None]
        turned = turned + noise * (rng.normal(size=basis.shape) + 1j * rng.normal(size=basis.shape))
        turned[0] = turned[0].real
        made.append(Record(f"r{i + 1}", setting(*cut), turned))
    return made


def with_settings(given, place):
    """Return records as though record i had the settings of record ``place[i]``."""
    return [replace(record, setting=given[k].setting) for record, k in zip(given, place, strict=True)]
