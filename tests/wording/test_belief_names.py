"""Names of parameters, as a reader meets them."""

import pytest

from metro.wording.names import BELIEFS, belief


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("ringing_off_far left", "frequencies of the tip at pose far left"),
        ("swing_12_x_pose-2", "mode 12 beside those of the tip, by the force along x, at pose pose-2"),
        ("loss_off_near", "damping ratio of the tip at pose near, over the known one"),
        ("at_once_z_B2", "share of the compliance that follows a force along z at once, at pose B2"),
        ("force_off_dyno_z", "force by the dyno, along z and relative to its size"),
        ("softer_joint_3", "compliance of joint 3 in the cut, against the load tests"),
        ("straight_joint_1", "share of the compliance of joint 1 that does not harden"),
        ("drag_of_a_hose", "drag of a hose"),
    ],
)
def test_a_belief_is_written_with_the_names_that_its_parameter_carries(name, words):
    assert belief(name) == words


def test_no_belief_is_written_with_a_placeholder():
    assert all(words.count("{}") <= pattern.count("(") for pattern, words in BELIEFS.items())
