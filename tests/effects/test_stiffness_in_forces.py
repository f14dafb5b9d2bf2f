"""An arm that is softer in the cut than in its load tests: side cuts are shallower than they seemed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from metro.cutting.cutter import Cutter, evenly_pitched
from metro.cutting.engagement import engagement
from metro.cutting.force import Cut
from metro.cutting.law import EdgeLaw
from metro.effects.effect import fitted_to
from metro.effects.stiffness_scale import OF_SIDE_CUTS
from metro.observables.force.dynamometer import Recording
from metro.observables.force.model import ForceModel, ForceSetting
from virtual_cell.chips import Tool
from virtual_cell.milling import Coefficients
from virtual_cell.side_force import SideCut, side_force

RADIUS, RADIAL, FACTOR = 6e-3, 3e-3, 0.7
SI = np.array([900e6, 350e6, 200e6, 20e3, 25e3, 5e3])
TOOL = Tool(RADIUS, 0.5, np.array([0.0, 2 * np.pi / 3, 4 * np.pi / 3]))


def simulated(direction, give):
    """Mean force of a side cut whose wall stands proud, feed frame: by the simulator."""
    cut = SideCut(TOOL, Coefficients(*SI), 3000.0, 3 * 50.0 * 0.08e-3, 4e-3, RADIAL, direction, 0.08)
    return side_force(cut, lambda _: give, speed_error=0.0, phase=0.0).turn.mean(axis=0)


def setting(direction, give):
    arc = engagement("side", direction, RADIAL - give, RADIUS)
    return ForceSetting(Cut(0.08e-3, 4e-3, arc), 0.0, 6, Recording((0.5,), 1.0, 50.0), 0.0, give=give)


@pytest.mark.parametrize("direction", ["up", "down"])
def test_a_softer_arm_cuts_less_and_the_force_is_that_of_the_depth_which_is_left(direction):
    model = OF_SIDE_CUTS.apply(
        ForceModel(Cutter(RADIUS, 0.5, evenly_pitched(3)), EdgeLaw()), {"factor": FACTOR}
    )
    give = 0.3e-3
    block = SimpleNamespace(setting=setting(direction, give), zeros=np.zeros((39, 3)))
    matrix, _ = model.design(block, np.zeros(1))
    mean = (matrix @ SI).reshape(3, 13)[:, 0]
    assert mean == pytest.approx(simulated(direction, give / FACTOR), rel=2e-3, abs=0.05)
    assert np.linalg.norm(mean) < 0.97 * np.linalg.norm(simulated(direction, give))


def sought(*settings):
    """Return the effect as it is fitted to runs."""
    model = ForceModel(Cutter(RADIUS, 0.5, evenly_pitched(3)), EdgeLaw())
    blocks = tuple(SimpleNamespace(setting=one) for one in settings)
    return fitted_to((OF_SIDE_CUTS,), SimpleNamespace(base=model, blocks=blocks, role=lambda *_: blocks))


def test_where_no_wall_gives_way_it_cannot_be_seen():
    one = setting("down", 0.0)
    assert sought(one) == ((), {})
    assert sought(replace(one, give=1e-4))[0] == (OF_SIDE_CUTS,)


def test_what_the_arm_may_give_more_counts_as_no_effect():
    one = setting("down", 0.0)
    runs = [replace(one, give=give, give_sd=sd) for give, sd in ((3e-4, 4e-5), (-4e-4, 3e-5), (0.0, 0.0))]
    ((effect,), _) = sought(*runs)
    assert effect.parameters[0].neutral_sd == pytest.approx(0.1)  # 50 µm of 500 µm
    assert replace(effect.parameters[0], neutral_sd=0.0) == OF_SIDE_CUTS.parameters[0]
