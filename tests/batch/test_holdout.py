import pandas as pd
from hypothesis import given, settings
from hypothesis import strategies as st

from metro.batch.files import RUN_FILES
from metro.batch.holdout import plan

COLUMNS = ("role", "stable", *RUN_FILES)
SETTINGS = {"operation": "slot", "spindle_rpm": 6000.0, "axial_depth_mm": 1.0, "radial_depth_mm": 10.0}


def table(*runs):
    """A run table, as filled in, of rows that say what differs."""
    rows = [
        {
            **dict.fromkeys(COLUMNS, ""),
            **SETTINGS,
            "run": f"r{i}",
            "order": i,
            "feed_per_tooth_mm": 0.05,
            **row,
        }
        for i, row in enumerate(runs, 1)
    ]
    return pd.DataFrame(rows, columns=["run", "order", "condition", "feed_per_tooth_mm", *SETTINGS, *COLUMNS])


def feeds(count, repeats=1, **more):
    """Rows of ``count`` feeds, each cut ``repeats`` times, all with a dynamometer."""
    return [
        {"condition": f"f{i}", "feed_per_tooth_mm": 0.01 * (i + 1), "dynamometer": "d", **more}
        for _ in range(repeats)
        for i in range(count)
    ]


runs_strategy = st.lists(
    st.fixed_dictionaries(
        {
            "condition": st.sampled_from("abcdefg"),
            "role": st.sampled_from(["", "", "", "identify", "validate"]),
            "dynamometer": st.sampled_from(["", "d"]),
            "profile": st.sampled_from(["", "p"]),
            "scan": st.sampled_from(["", "s"]),
            "stable": st.sampled_from(["", "yes", "no"]),
            "operation": st.sampled_from(["slot", "side"]),
            "feed_per_tooth_mm": st.sampled_from([0.02, 0.04, 0.06]),
        }
    ),
    max_size=20,
)


@settings(max_examples=40, deadline=None)
@given(runs_strategy, st.floats(0.05, 0.95), st.integers(0, 5))
def test_every_recorded_run_has_one_role_and_no_other_run_has_any(rows, share, seed):
    runs = table(*rows)
    made = plan(runs, share, seed)
    recorded = [f"r{i}" for i, row in enumerate(rows, 1) if any(row[name] for name in row if name in COLUMNS)]
    assert sorted(made["identify"] + made["validate"]) == sorted(recorded)


@settings(max_examples=40, deadline=None)
@given(runs_strategy, st.integers(0, 5), st.randoms())
def test_the_plan_depends_on_the_seed_but_not_on_the_order_of_the_rows(rows, seed, shuffle):
    runs = table(*rows)
    places = list(range(len(runs)))
    shuffle.shuffle(places)
    assert plan(runs, 0.34, seed) == plan(runs.iloc[places].reset_index(drop=True), 0.34, seed)


@settings(max_examples=40, deadline=None)
@given(runs_strategy)
def test_whole_conditions_are_held_out(rows):
    rows = [{**row, "role": ""} for row in rows]
    made = plan(table(*rows), 0.34, 1)
    condition = {f"r{i}": row["condition"] for i, row in enumerate(rows, 1)}
    assert not {condition[run] for run in made["identify"]} & {condition[run] for run in made["validate"]}


@settings(max_examples=40, deadline=None)
@given(st.integers(3, 12), st.integers(1, 3), st.floats(0.01, 0.99), st.integers(0, 9))
def test_the_share_of_conditions_is_held_out_but_two_are_always_kept(count, repeats, share, seed):
    made = plan(table(*feeds(count, repeats)), share, seed)
    assert len(made["validate"]) == repeats * min(max(1, round(share * count)), count - 2)


@settings(max_examples=40, deadline=None)
@given(st.integers(3, 12), st.integers(0, 50))
def test_the_ends_of_the_range_of_feeds_are_kept_while_there_are_feeds_between(count, seed):
    made = plan(table(*feeds(count)), 0.34, seed)
    assert {"r1", f"r{count}"} <= set(made["identify"])


def test_seeds_differ_in_what_they_hold_out():
    assert len({tuple(plan(table(*feeds(9)), 0.34, seed)["validate"]) for seed in range(20)}) > 5


def test_with_fewer_than_three_conditions_none_is_held_out_and_that_is_said():
    made = plan(table(*feeds(2, 3)), 0.34, 1)
    assert made["validate"] == []
    assert "dynamometer: none of 2 conditions held out: at least 3 are needed" in made["how"]


def test_the_roles_of_the_table_stand():
    runs = feeds(3)
    roles = ["validate", "identify", "validate"]
    made = plan(table(*({**run, "role": role} for run, role in zip(runs, roles, strict=True))), 0.34, 1)
    assert (made["validate"], made["identify"]) == (["r1", "r3"], ["r2"])
    assert made["how"] == "roles as the run table states them"


def test_a_blank_role_follows_the_other_runs_of_its_condition():
    runs = feeds(4, 2)
    runs[2]["role"] = "validate"
    made = plan(table(*runs), 0.25, 1)
    assert made["validate"] == ["r3", "r7"]


def test_each_kind_of_measurement_keeps_both_roles():
    forces = feeds(8)
    for run in forces[1:4]:
        run["profile"] = "p"
    scans = [{"condition": f"s{i}", "scan": "s", "operation": "face"} for i in range(3)]
    labels = [{"condition": f"l{i}", "stable": "yes", "spindle_rpm": 1000.0 * (i + 1)} for i in range(4)]
    rows = [*forces, *scans, *labels]
    for seed in range(20):
        made = plan(table(*rows), 0.34, seed)
        for column in ("dynamometer", "profile", "scan", "stable"):
            having = {f"r{i}" for i, row in enumerate(rows, 1) if row.get(column)}
            assert having & set(made["identify"])
            assert having & set(made["validate"])


def labels(speeds, depths=3, **more):
    """Rows of tests at ``depths`` depths of each speed, every one a condition of its own."""
    return [
        {
            "condition": f"l{speed:g}-{depth}",
            "spindle_rpm": speed,
            "axial_depth_mm": 1.0 + depth,
            "stable": "yes",
            **more,
        }
        for depth in range(depths)
        for speed in speeds
    ]


def speeds_by_role(rows, share=0.34, seed=1):
    made = plan(table(*rows), share, seed)
    return tuple(
        {rows[int(run[1:]) - 1]["spindle_rpm"] for run in made[role]} for role in ("identify", "validate")
    )


@settings(max_examples=40, deadline=None)
@given(st.integers(4, 10), st.integers(1, 4), st.floats(0.05, 0.95), st.integers(0, 20))
def test_of_labelled_tests_whole_speeds_are_held_out(count, depths, share, seed):
    speeds = [2000.0 + 500.0 * i for i in range(count)]
    kept, out = speeds_by_role(labels(speeds, depths), share, seed)
    assert not kept & out
    assert len(out) == min(max(1, round(share * count)), count - 2)
    if len(out) <= count - 2:
        assert {speeds[0], speeds[-1]} <= kept


def test_labels_at_three_speeds_are_held_out_by_condition():
    kept, out = speeds_by_role(labels([2000.0, 3000.0, 4000.0], 4))
    assert kept & out


def test_a_run_that_the_table_holds_out_leaves_the_rest_to_conditions():
    rows = labels([2000.0, 3000.0, 4000.0, 5000.0])
    rows[1]["role"] = "validate"
    made = plan(table(*rows), 0.34, 1)
    assert "r2" in made["validate"]
    assert "whole spindle speeds" not in made["how"]


def test_a_speed_that_the_table_gives_to_identification_stays_whole_there():
    rows = labels([2000.0, 3000.0, 4000.0, 5000.0, 6000.0])
    rows[2]["role"] = "identify"
    for seed in range(10):
        kept, out = speeds_by_role(rows, 0.34, seed)
        assert 4000.0 in kept
        assert not kept & out


def test_held_out_speeds_are_told():
    made = plan(table(*labels([2000.0, 3000.0, 4000.0, 5000.0])), 0.25, 1)
    assert "stability: 1 of 4 whole spindle speeds held out (rev/min): " in made["how"]


def test_the_only_condition_of_an_operation_is_kept():
    rows = [*feeds(3), {"condition": "h", "operation": "helical", "dynamometer": "d"}]
    for seed in range(20):
        assert "r4" in plan(table(*rows), 0.5, seed)["identify"]


def test_no_recorded_run_makes_an_empty_plan():
    assert plan(table({"condition": "a"}), 0.34, 1) == {
        "identify": [],
        "validate": [],
        "how": "no run was recorded",
        "seed": 1,
    }
