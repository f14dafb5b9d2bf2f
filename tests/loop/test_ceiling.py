"""How much any cause could explain: patterns that are put in, found again; and the real slot."""

import numpy as np
import pytest

from metro.loop import ceiling as room
from metro.wording.residual import SENTENCES

FEEDS = (0.02, 0.05, 0.08, 0.1, 0.13)


def runs(seed, same, feed, alone, shape=(3, 40)):
    """Runs of five feeds, whose residuals have parts of these powers, and two runs of each."""
    rng = np.random.default_rng(seed)

    def drawn(power):
        return np.sqrt(power / 2) * (rng.normal(size=shape) + 1j * rng.normal(size=shape))

    scale = np.sqrt(np.mean(np.square(FEEDS)))
    constant, growing = drawn(same), drawn(feed)
    found = []
    for i, each in enumerate(FEEDS):
        whole = constant + growing * each / scale + drawn(alone)
        for replicate in range(2):
            settings = {"feed": each, "depth": 2.0}
            noisy = whole + drawn(1e-6)
            found.append(
                room.Run(f"r{i}{replicate}", f"c{i}", noisy, 0.0, 4.0 * room._power(whole), settings)
            )
    return found


@pytest.mark.parametrize(("same", "feed", "alone"), [(4.0, 0.0, 1.0), (0.0, 4.0, 0.5), (2.0, 2.0, 0.2)])
def test_the_parts_are_those_that_were_put_in(same, feed, alone):
    parts = [room._parts(room._pattern(runs(seed, same, feed, alone))) for seed in range(6)]
    whole = same + feed + alone
    for name, power in (("same", same), ("feed", feed), ("alone", alone)):
        assert np.mean([each[name] for each in parts]) == pytest.approx(power / whole, abs=0.07)
    assert "depth" not in parts[0]


def test_what_does_not_repeat_is_predicted_by_nothing_and_what_repeats_wholly():
    nothing, (low, high) = room._unseen_share(runs(1, 0.0, 0.0, 1.0))
    assert nothing < 0.1
    assert low < 0.0 < high
    everything, (low, high) = room._unseen_share(runs(2, 3.0, 1.0, 1e-4))
    assert everything > 0.99
    assert low > 0.9


def test_the_share_is_that_of_the_best_linear_prediction():
    """With known variances the conditional variance of a condition given the others is a closed form."""
    same, alone = 2.0, 1.0
    n = len(FEEDS) - 1
    left = alone * (1.0 + same / (alone + n * same))  # of a common mean from n others, plus its own
    shares = [room._unseen_share(runs(seed, same, 0.0, alone))[0] for seed in range(8)]
    assert np.mean(shares) == pytest.approx(1.0 - left / (same + alone), abs=0.08)


@pytest.mark.parametrize(("low", "points"), [(0.1, True), (-0.1, False)])
def test_a_kind_is_named_only_where_more_than_chance_is_predicted(low, points):
    values = {
        "parts": {"depth": 0.4, "same": 0.01, "alone": 0.59},
        "share": 0.3,
        "ci95": [low, 0.5],
        "noise_share": 0.0,
        "places": [{"axis": "x", "label": "order 2", "share": 1.0}],
        "held_out": [],
    }
    words = SENTENCES["ceiling"](values)
    assert ("end of the tool" in words) is points
    assert ("may be chance" in words) is not points


def test_what_would_remain_of_a_held_out_run_is_not_called_its_error():
    """The error of a run, 47 % of the signal, was stated as the 6 % that its prediction by others leaves."""
    values = {
        "parts": {"feed": 0.5, "same": 0.4, "alone": 0.1},
        "share": 0.9,
        "ci95": [0.8, 1.0],
        "noise_share": 0.0,
        "places": [{"axis": "x", "label": "order 2", "share": 1.0}],
        "held_out": [{"run": "r03", "share": 0.98, "of_signal": 0.06}],
    }
    words = SENTENCES["ceiling"](values)
    assert "98 % in held-out run r03 (an error of 6 % of the signal would remain)" in words
    assert words.startswith("Of the squared error of the base model, 50 % grows with the feed")
