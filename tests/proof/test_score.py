"""Right and wrong, on truths and verdicts written by hand."""

import pytest

from metro.loop.labels.search import NOTHING
from metro.loop.labels.unknown import UNKNOWN
from proof.answers import complete
from proof.figures import over_floor, over_stated
from proof.score import FAILED, score


def truth(kind, **effects):
    return {"batch": "blind-1", "kind": kind, "effects": effects}


def oracle(after=2.0, **sizes):
    return {"before": 10.0, "after": after, "floor": 1.9, "sizes": sizes}


def verdict(status, *named, candidates=(), groups=(), rest=None, after=2.5, observable="force"):
    entry = {
        "status": status,
        "noise_floor": 2.0,
        "before": {"rms": 10.0},
        "after": {"rms": after},
        "effects": [{"effect": name, "probability": p, "parameters": {}} for name, p in named],
        "candidates": [{"effect": name, "probability": p} for name, p in candidates],
        "indistinguishable": [list(group) for group in groups],
        "unexplained": rest,
    }
    return {"observables": {observable: entry}}


def scored(hidden, asked, found, observable="force", **told):
    said = None if found is None else complete({**found["observables"][observable], **told})
    return score(hidden, asked, said, teeth=3, observable=observable)


RUNOUT = truth("one", tool_runout={"radius_um": 5.0})
BOTH = truth("two", tool_runout={"radius_um": 5.0}, tool_wear={"edge_growth_per_m": 0.1})


ALWAYS = RUNOUT | {"always_on": {"tool_end": {"corner_radius_mm": 0.2}}}


def test_what_a_cell_always_has_is_neither_demanded_nor_false():
    asked = oracle(tool_runout=3.0)
    with_it = scored(ALWAYS, asked, verdict("explained", ("tool_end", 0.99), ("tool_runout", 0.98)))
    without = scored(ALWAYS, asked, verdict("explained", ("tool_runout", 0.98)))
    for one in (with_it, without):
        assert one.exact
        assert not one.surely_wrong
        assert list(one.named) == ["tool_runout"]
    assert with_it.stated == ((0.99, True), (0.98, True))
    assert not scored(RUNOUT, asked, verdict("explained", ("tool_end", 0.99), ("tool_runout", 0.98))).exact


def test_where_nothing_is_hidden_only_what_is_not_there_counts_as_added():
    nothing = truth("none") | {"always_on": {"tool_end": {"corner_radius_mm": 0.2}}}
    assert not scored(nothing, None, verdict("explained", ("tool_end", 0.99))).added
    assert scored(nothing, None, verdict("explained", ("tool_end", 0.99), ("tool_wear", 0.95))).added


def test_nothing_is_demanded_of_the_probability_of_what_is_always_there_and_not_named():
    one = scored(ALWAYS, oracle(tool_runout=3.0), verdict("clean", candidates=[("tool_end", 0.02)]))
    assert one.rejected == ()


REVERSAL = truth("one", friction_reversal={"joint": 4, "torque_nm": 9.0}) | {
    "always_on": {
        "friction_reversal": [{"joint": 1, "torque_nm": 2.0}, {"joint": 2, "torque_nm": 3.0}],
        "joint_backlash": [{"joint": 3, "angle_mdeg": 0.4}],
    }
}


def of_joints(*named, groups=()):
    """Return what a verdict says that names effects (name, joint)."""
    found = verdict("explained", *((name, 0.99) for name, _ in named), groups=groups)
    for one, (_, joint) in zip(found["observables"]["force"]["effects"], named, strict=True):
        one["parameters"] = {"joint": joint}
    return found


def test_what_is_always_there_in_one_joint_is_false_in_another():
    asked = oracle(friction_reversal=3.0)
    hidden = ("friction_reversal", 4)
    for beside in (("friction_reversal", 2), ("joint_backlash", 3)):
        one = scored(REVERSAL, asked, of_joints(hidden, beside))
        assert list(one.named) == ["friction_reversal"]
        assert one.exact
        assert one.stated == ((0.99, True), (0.99, True))
    for beside in (("friction_reversal", 3), ("joint_backlash", 5)):
        one = scored(REVERSAL, asked, of_joints(hidden, beside))
        assert len(one.extra) == 1
        assert not one.exact
        assert one.surely_wrong
        assert one.stated == ((0.99, True), (0.99, False))


def test_naming_what_is_always_there_does_not_find_what_is_hidden():
    one = scored(REVERSAL, oracle(friction_reversal=3.0), of_joints(("friction_reversal", 1)))
    assert one.named == {}
    assert not one.both
    assert not one.extra


def test_a_rival_of_what_is_always_there_is_no_false_one():
    alike = [["friction_reversal (joint 2)", "joint_backlash (joint 6)"]]
    found = of_joints(("friction_reversal", 4), ("joint_backlash", 6), groups=alike)
    assert not scored(REVERSAL, oracle(friction_reversal=3.0), found).extra


def test_one_effect_named_alone_is_right():
    one = scored(RUNOUT, oracle(tool_runout=3.0), verdict("explained", ("tool_runout", 0.99)))
    assert one.exact
    assert one.seen
    assert not one.surely_wrong
    assert one.share == pytest.approx(7.5 / 8.0)
    assert over_floor([one]) == [pytest.approx(2.5 / 1.9)]  # the noise alone
    assert over_stated([one]) == [pytest.approx(2.5 / 2.0)]


def test_one_effect_with_a_false_one_beside_it_is_not():
    found = verdict("explained", ("tool_runout", 0.99), ("pitch_error", 0.95))
    one = scored(RUNOUT, oracle(tool_runout=3.0), found)
    assert not one.exact
    assert one.both
    assert one.extra == {"pitch_error"}
    assert one.surely_wrong


def test_the_right_one_first_of_declared_rivals_is_right_and_second_is_not():
    rivals = [("tool_runout", "pitch_error")]
    first = verdict("undetermined", ("tool_runout", 0.6), groups=rivals)
    second = verdict("undetermined", ("pitch_error", 0.6), groups=[("pitch_error", "tool_runout")])
    asked = oracle(tool_runout=3.0)
    assert scored(RUNOUT, asked, first).exact
    assert not scored(RUNOUT, asked, second).exact


def test_an_undetermined_verdict_that_adds_nothing_names_the_first_of_its_rivals():
    rivals, candidates = [("tool_runout", "pitch_error")], [("tool_runout", 0.5), ("pitch_error", 0.4)]
    found = verdict("undetermined", groups=rivals, candidates=candidates)
    assert scored(RUNOUT, oracle(tool_runout=3.0), found).named == {"tool_runout": 0.5}


def test_rivals_among_themselves_excuse_no_false_addition():
    found = verdict(
        "undetermined", ("tool_runout", 1.0), ("tool_wear", 0.6), groups=[("tool_wear", "charge_drift")]
    )
    assert scored(RUNOUT, oracle(tool_runout=3.0), found).extra == {"tool_wear"}


def test_two_effects_may_be_named_in_any_order_and_one_is_not_both():
    asked = oracle(tool_runout=3.0, tool_wear=2.0)
    swapped = verdict("explained", ("tool_wear", 0.9), ("tool_runout", 0.9))
    assert scored(BOTH, asked, swapped).exact
    assert not scored(BOTH, asked, verdict("explained", ("tool_wear", 0.9))).both


BACKLASH = truth("one", joint_backlash={"joint": 3, "angle_mdeg": 5.0})


def in_joint(joint, groups=(), status="explained"):
    found = verdict(status, ("joint_backlash", 0.97), groups=groups)
    where = {} if joint is None else {"joint": joint}
    size = {"angle_mdeg": {"value": 5.1, "ci95": [4.9, 5.3]}}
    found["observables"]["force"]["effects"][0]["parameters"] = {**where, **size}
    return scored(BACKLASH, oracle(joint_backlash=3.0), found)


def test_the_right_effect_in_a_wrong_joint_is_a_wrong_attribution():
    right, wrong = in_joint(3), in_joint(2)
    assert right.exact
    assert not right.surely_wrong
    assert right.stated == ((0.97, True),)
    assert [one.parameter for one in right.estimates] == ["angle_mdeg"]
    assert not wrong.exact
    assert wrong.surely_wrong
    assert wrong.extra == {"joint_backlash, another joint"}
    assert wrong.stated == ((0.97, False),)
    assert not wrong.estimates


def test_of_joints_that_are_declared_rivals_the_right_one_must_come_first():
    rivals = [("joint_backlash (joint 3)", "joint_backlash (joint 2)")]
    first = in_joint(3, rivals, "undetermined")
    second = in_joint(2, [rivals[0][::-1]], "undetermined")
    assert first.exact
    assert not second.exact
    assert second.among
    assert not second.extra


def test_an_effect_of_all_joints_is_not_that_of_one():
    scale = truth("one", stiffness_scale={"factor": 0.8, "joint": "all"})
    asked = oracle(stiffness_scale=3.0)
    for parameters, exact in (({}, True), ({"joint": "all"}, True), ({"joint": 2}, False)):
        found = verdict("explained", ("stiffness_scale", 0.97))
        found["observables"]["force"]["effects"][0]["parameters"] = parameters
        assert scored(scale, asked, found).exact is exact


@pytest.mark.parametrize(
    ("found", "right"),
    [
        (verdict("clean"), True),
        (verdict("explained", ("tool_runout", 0.9)), True),
        (verdict("explained", ("pitch_error", 0.9)), False),
        (verdict("unexplained", rest={}), False),
    ],
)
def test_below_the_noise_clean_is_right_and_a_false_one_is_not(found, right):
    assert scored(RUNOUT, oracle(tool_runout=0.4), found).right is right
    assert scored(RUNOUT, oracle(tool_runout=2.0), verdict("clean")).right is False


def test_an_effect_below_the_noise_is_not_asked_for_nor_does_its_probability_count():
    found = verdict("explained", ("tool_wear", 0.9), candidates=[("tool_runout", 0.3), ("pitch_error", 0.1)])
    one = scored(BOTH, oracle(tool_runout=0.5, tool_wear=2.0), found)
    assert not one.seen
    assert one.seen_named
    assert one.stated == ((0.9, True),)
    assert one.rejected == ((0.1, False),)


OUTSIDE = truth("outside", chipped_tooth={"length_um": 20.0})


@pytest.mark.parametrize(
    ("found", "admitted", "wrong"),
    [
        (verdict("unexplained", rest={}), True, False),
        (verdict("partly_explained", ("tool_runout", 0.99), rest={}), True, False),
        (verdict("explained", ("tool_runout", 0.4)), False, True),
        (
            verdict("undetermined", ("tool_runout", 0.95), groups=[("tool_runout", "pitch_error")]),
            False,
            True,
        ),
        (
            verdict("undetermined", ("tool_runout", 0.5), groups=[("tool_runout", "pitch_error")]),
            False,
            False,
        ),
        (verdict("clean"), False, False),
    ],
)
def test_outside_the_library_a_rest_must_be_admitted(found, admitted, wrong):
    one = scored(OUTSIDE, oracle(after=None, chipped_tooth=3.0), found)
    assert one.admitted is admitted
    assert one.misattributed is wrong
    assert one.share is None


def test_a_batch_that_the_pipeline_could_not_run_is_right_in_nothing():
    one = scored(RUNOUT, None, None)
    assert one.status == FAILED
    assert [one.exact, one.both, one.detected] == [False, False, False]
    assert not scored(truth("none"), None, None).exact


def test_what_the_verdict_says_cannot_be_seen_is_read():
    hidden = truth("one", dynamometer_rotation={"angle_deg": 3.0})
    one = scored(
        hidden, oracle(dynamometer_rotation=0.1), verdict("clean"), cannot_be_seen=["dynamometer_rotation"]
    )
    assert one.cannot_be_seen == ("dynamometer_rotation",)
    assert not one.seen


def lobes(hidden, found, asked=None):
    return scored(
        hidden, asked, {"observables": {"lobes": found["observables"]["force"]}}, observable="lobes"
    )


COUPLED = truth("one", mode_coupling={"angle_deg": 20.0})


def test_an_effect_that_may_as_well_be_nothing_is_not_added_unless_it_is_claimed():
    rivals = [("process_damping", "nothing")]
    candidates = [("process_damping", 0.6)]
    weighed = lobes(truth("none"), verdict("undetermined", candidates=candidates, groups=rivals))
    assert weighed.undecided
    assert not weighed.added
    claimed = lobes(truth("none"), verdict("undetermined", ("process_damping", 0.8), groups=rivals))
    assert claimed.added
    other = [("process_damping", "mode_coupling")]
    assert lobes(truth("none"), verdict("undetermined", candidates=candidates, groups=other)).added


def test_nothing_excuses_no_addition_where_something_is_hidden():
    found = verdict("undetermined", ("process_damping", 0.8), groups=[("process_damping", "nothing")])
    assert lobes(COUPLED, found, oracle(mode_coupling=3.0)).extra == {"process_damping"}


def test_with_too_few_tests_nothing_counts_as_seen():
    asked = oracle(mode_coupling=3.0)
    assert lobes(COUPLED, verdict("insufficient"), asked).seen
    assert not lobes(COUPLED, verdict("insufficient"), {**asked, "enough": False}).seen


def test_candidates_of_labels_are_whole_hypotheses():
    tried = [("mode_coupling", 0.2), ("process_damping", 0.1), ("mode_coupling + process_damping", 0.7)]
    both = truth("two", process_damping={"coefficient_n_mm": 90.0}, mode_coupling={"angle_deg": 20.0})
    found = verdict("undetermined", candidates=tried)
    large = oracle(mode_coupling=3.0, process_damping=2.0)
    assert lobes(COUPLED, found, large).rejected == ((0.2, True), (0.1, False), (0.7, False))
    assert lobes(both, found, large).rejected == ((0.2, False), (0.1, False), (0.7, True))
    assert lobes(both, found, oracle(mode_coupling=3.0, process_damping=0.5)).rejected == ()


def test_a_rival_that_is_declared_is_among_what_is_possible():
    found = verdict("undetermined", ("process_damping", 0.6), groups=[("process_damping", "mode_coupling")])
    one = lobes(COUPLED, found, oracle(mode_coupling=3.0))
    assert one.among
    assert not one.exact


def test_another_cause_is_no_name_that_could_be_wrong():
    """Of labels that no effect explains: it is left open whether something acts, and nothing is named."""
    entry = {
        "status": "undetermined",
        "effects": [],
        "candidates": [
            {"effect": UNKNOWN, "probability": 0.95},
            {"effect": "missing_mode", "probability": 0.01},
        ],
        "indistinguishable": [[UNKNOWN, NOTHING]],
        "before": {"rms": 0.5},
        "after": {"rms": 0.5},
        "noise_floor": 0.3,
        "unexplained": {"rms": 0.5},
    }
    truth = {"batch": "b", "kind": "outside", "effects": {"tool_runout": {"radius_um": 9.0}}}
    found = score(truth, None, complete(entry), teeth=2, observable="lobes")
    assert found.named == {}
    assert found.admitted
    assert not found.surely_wrong
    assert found.rejected == ((0.01, False),)
