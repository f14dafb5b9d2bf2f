"""No drift is faster than the means of the revolutions change along the records."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import Engagement
from metro.cutting.force import Cut
from metro.cutting.law import EdgeLaw
from metro.effects import charge_drift
from metro.observables.force.dynamometer import Recording
from metro.observables.force.model import ForceModel, ForceSetting

MODEL = ForceModel(Cutter(5e-3, 0.6, evenly_pitched(2)), EdgeLaw())
RECORDING = Recording((0.5,), 1.0, 20.0)
CUT = Cut(0.05e-3, 1e-3, Engagement(0.0, np.pi))


def adapted(recordings, conditions=None, role="identify"):
    """Parameter of the third channel, after the bounds were set by records of these conditions."""
    blocks = tuple(
        SimpleNamespace(setting=ForceSetting(CUT, 0.0, 12, recording, 0.0), condition=name)
        for recording, name in zip(recordings, conditions or range(len(recordings)), strict=True)
    )
    roles = {role: blocks}
    task = SimpleNamespace(base=MODEL, role=lambda *names: sum((roles.get(one, ()) for one in names), ()))
    return charge_drift.adapt(charge_drift.EFFECT, task)


def read(slope, sd):
    return replace(RECORDING, slope=(0.0, 0.0, slope), slope_sd=(0.5, 0.5, sd))


def test_no_drift_is_faster_than_the_means_of_the_revolutions():
    effect = adapted([read(slope, 3.0) for slope in (-0.7, 1.7, 8.5, -17.9, -4.7)])
    z = effect.parameters[2]
    assert -60.0 < z.lower < 0.0 < z.upper < 60.0
    assert effect.parameters[0].upper < 2.0


def test_a_drift_that_all_records_show_is_within_the_bounds():
    z = adapted([read(slope, 0.5) for slope in (7.6, 8.2, 8.3)]).parameters[2]
    assert z.lower < 0.0
    assert z.upper > 8.3


def test_records_that_were_not_read_or_only_verify_leave_the_drift_open():
    assert adapted([RECORDING]) is charge_drift.EFFECT
    assert adapted([read(8.0, 0.5)] * 3, role="validate") is charge_drift.EFFECT


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_where_the_records_show_a_slope_the_largest_drift_that_they_allow_is_a_result(sign):
    shown = adapted([read(sign * slope, 0.3) for slope in (5.1, 4.9, 5.3, 4.8, 5.2)]).parameters[2]
    assert (shown.nothing_below, shown.nothing_above) == (sign < 0.0, sign > 0.0)
    none = adapted([read(sign * slope, 0.3) for slope in (0.6, -0.9, 0.3, 1.1, -0.2)]).parameters[2]
    assert (none.nothing_below, none.nothing_above) == (False, False)


def test_what_the_repeats_of_a_condition_share_is_no_evidence_of_many_records():
    """Eight conditions change the force by 0.4 N/s each on their own, whatever the drift; four repeats."""
    rng = np.random.default_rng(11)
    alike = np.repeat(np.arange(8), 4)
    outside, width = 0, []
    for _ in range(400):
        rate = -3.7 + 0.4 * rng.normal(size=8)[alike] + 0.2 * rng.normal(size=32)
        low, high = charge_drift.within(rate, np.full(32, 0.2), alike)
        outside += not low < -3.7 < high
        width.append(high - low)
    assert outside <= 4  # of 400, at 0.1 %: five or more have a probability of 8e-5
    assert np.median(width) < 2.0  # 2 t(0.9995; 7) √(0.16 + 0.01) / √8 = 1.58
