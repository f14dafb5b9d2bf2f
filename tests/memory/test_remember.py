"""What a campaign remembers of its batches: series, pooled estimates, what comes back."""

import numpy as np
import pytest
from drawn_campaigns import STEP_AFTER, drawn, estimate, quantity, record, tried, truth

from metro.memory.history import histories
from metro.memory.remember import remember

CAMPAIGNS = 200
NAMES = {
    "cutting coefficient kte": "kte",
    "cutting coefficient ktc": "ktc",
    "stiffness of joint 1": "joint 2",
    "rate_um_per_min": "growth",
}


@pytest.fixture(scope="module")
def campaign():
    records, _ = drawn(np.random.default_rng([11, 77]))
    return records, remember(records)


def test_wear_warm_up_and_a_mended_joint_are_followed_and_a_steady_coefficient_is_left_alone(campaign):
    _, memory = campaign
    found = {NAMES[row["quantity"]]: row for row in memory["series"]}
    assert {name: row["course"] for name, row in found.items()} == {
        "kte": "trend",
        "growth": "levels off",
        "joint 2": "step",
        "ktc": "steady",
    }
    assert found["joint 2"]["step_between"] == [f"b-{STEP_AFTER + 1}", f"b-{STEP_AFTER + 2}"]
    last = truth(np.arange(21))
    for name in ("kte", "growth", "joint 2"):
        low, high = found[name]["next"]["ci95"]
        assert low < last[name][20] < high


def test_an_effect_below_every_batchs_gates_is_shown_by_all_together():
    def campaign_of(tilt):
        rng = np.random.default_rng(12)
        return [
            record(
                f"b-{i}",
                "clean",
                [
                    tried(
                        "spindle_tilt",
                        "rejected",
                        estimate("about_x_mrad", rng.normal(tilt, 0.02), 0.02, "mrad"),
                    )
                ],
            )
            for i in range(20)
        ]

    (there,) = remember(campaign_of(0.03))["pooled"]
    (absent,) = remember(campaign_of(0.0))["pooled"]
    assert there["shown"]
    assert there["estimate"]["ci95"][0] < 0.03 < there["estimate"]["ci95"][1]
    assert not absent["shown"]


def test_one_sign_that_is_smaller_than_the_models_own_error_is_nobodys_effect():
    records = [
        record(
            f"b-{i}",
            "clean",
            [
                tried(
                    "fixture_bow",
                    "rejected",
                    estimate("xx_um", 1.0 + 0.01 * (i % 3), 0.1, "um"),
                    size=0.002,
                )
            ],
        )
        for i in range(10)
    ]
    (row,) = remember(records)["pooled"]
    assert (row["shown"], row["below_budget"]) == (False, True)
    assert row["size"] == pytest.approx(0.002, rel=0.05)


@pytest.mark.parametrize("status", ["unexplained", "undetermined", "insufficient"])
def test_estimates_of_batches_that_are_not_settled_do_not_count(status):
    one = tried("fixture_bow", "rejected", estimate("xx_um", 5.0, 0.1, "um"))
    assert histories([record(f"b-{i}", status, [one]) for i in range(4)]) == []


def test_the_best_of_many_forms_is_no_estimate_where_it_was_not_claimed():
    one = tried("fixture_bow", "rejected", estimate("xx_um", 5.0, 0.1, "um")) | {"chosen_among": 6}
    assert histories([record(f"b-{i}", "clean", [one]) for i in range(4)]) == []


def test_batches_are_ordered_by_their_start_or_else_by_their_numbers():
    def one(name, started):
        identified = {"tip": {"a0": quantity(1.0, 0.1, "1")}}
        return record(name, "clean", [], identified=identified, started=started)

    times = [1.7e9 + 86400.0 * day for day in (9, 0, 4)]
    (by_time,) = histories([one(f"b-{i}", t) for i, t in zip((2, 10, 1), times, strict=True)])
    assert [entry.batch for entry in by_time.entries] == ["b-10", "b-1", "b-2"]
    assert (by_time.clock, by_time.t.tolist()) == ("days", [0.0, 4.0, 9.0])
    (by_name,) = histories([one("b-2", times[0]), one("b-10", None), one("b-1", times[2])])
    assert [entry.batch for entry in by_name.entries] == ["b-1", "b-2", "b-10"]
    assert by_name.clock == "batches"


def test_another_cell_has_a_history_of_its_own():
    identified = {"tip": {"a0": quantity(1.0, 0.1, "1")}}
    cells = ["cell-a", "cell-b", "cell-a", "cell-b"]
    found = histories(
        [record(f"b-{i}", "clean", [], identified=identified, cell=c) for i, c in enumerate(cells)]
    )
    assert [(one.owner, len(one.entries)) for one in found] == [("cell-a", 2), ("cell-b", 2)]


def test_what_comes_back_is_counted_and_told_where_a_batch_is_undecided():
    growth = tried("thermal_growth", "added", estimate("rate_um_per_min", 5.0, 0.2, "um/min"))
    bow = tried("fixture_bow", "rejected", estimate("xx_um", 0.1, 0.2, "um"))
    settled = [record(f"b-{i}", "explained", [growth, bow], ["thermal_growth"]) for i in range(4)]
    pair = [["fixture_bow", "thermal_growth"]]
    doubtful = record("c-1", "undetermined", [growth, bow], ["thermal_growth"], indistinguishable=pair)
    memory = remember([*settled, doubtful])
    (row,) = memory["recurring"]
    assert (row["effect"], len(row["found"]), len(row["tried"])) == ("thermal_growth", 4, 4)
    assert 0.0 < row["share"]["ci95"][0] < row["share"]["ci95"][1] <= 1.0
    (told,) = memory["undecided"]
    assert told["elsewhere"] == {"fixture_bow": [0, 4], "thermal_growth": [4, 4]}


def test_a_campaign_of_one_batch_has_no_history():
    memory = remember([record("b-1", "clean", [])])
    assert [memory[key] for key in ("series", "pooled", "recurring", "undecided")] == [[], [], [], []]


def test_what_all_batches_may_get_wrong_alike_is_in_the_course_of_a_coefficient():
    """Twenty batches are as far off together as one: the budget does not average out."""
    records, _ = drawn(np.random.default_rng(4), 20)
    plain = {row["quantity"]: np.array(row["track"]) for row in remember(records)["series"]}
    for one in records:
        one.loop.setdefault("observables", {}).setdefault("force", {})["noise"] = {"budget": 0.01}
    for row in remember(records)["series"]:
        low, middle, high = np.array(row["track"]).T
        own = plain[row["quantity"]].T
        np.testing.assert_allclose(middle, own[1])
        coefficient = row["quantity"].startswith("cutting coefficient")
        wrong = 0.0196 * np.abs(middle) if coefficient and not row["effect"] else 0.0
        np.testing.assert_allclose(middle - low, np.hypot(own[1] - own[0], wrong), rtol=1e-4)
        np.testing.assert_allclose(high - middle, np.hypot(own[2] - own[1], wrong), rtol=1e-4)
    assert any(name.startswith("cutting coefficient") for name in plain)


@pytest.mark.slow
def test_over_many_campaigns_intervals_cover_as_they_say():
    covered, coming, false = [], [], 0
    for seed in range(CAMPAIGNS):
        rng = np.random.default_rng([seed, 77])
        records, own = drawn(rng, 21)
        for row in remember(records[:-1])["series"]:
            name = NAMES[row["quantity"]]
            track, true = np.array(row["track"]), truth(np.arange(20))[name]
            covered.append(np.mean((track[:, 0] <= true) & (true <= track[:, 2])))
            low, high = row["next"]["ci95"]
            coming.append(low <= own[name][20] + rng.normal(0.0, np.median(row["sd"])) <= high)
            false += name == "ktc" and row["course"] != "steady"
    # Twice the standard deviation of a share of 95 % among so many campaigns.
    slack = 2.0 * np.sqrt(0.95 * 0.05 / CAMPAIGNS)
    assert abs(np.mean(covered) - 0.95) < slack
    assert abs(np.mean(coming) - 0.95) < slack
    assert false <= 0.05 * CAMPAIGNS * (1.0 + 2.0 / np.sqrt(0.05 * CAMPAIGNS))
