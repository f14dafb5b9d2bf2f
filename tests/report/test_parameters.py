"""Parameters of effects in words: what is not determined is not printed as a number."""

from metro.report.parameters import NOT_IDENTIFIED, effect_words, parameter_value


def entry(value, low, high, unit="Hz", **more):
    return {"value": value, "ci95": [low, high], "unit": unit} | more


OPEN = entry(20000.0, 100.0, 20000.0, told=False)


def test_a_number_of_which_nothing_is_told_is_not_printed():
    assert parameter_value({}, entry(170.0, -10.0, 350.0, "deg", told=False)) == NOT_IDENTIFIED
    assert parameter_value({}, entry(170.0, 160.0, 180.0, "deg")) == "170 ± 10°"
    assert parameter_value({}, entry(3.0, 1.0, 5.0, "um")) == "3.0 ± 2.0 µm"
    assert parameter_value({}, 4) == "4"


def test_lists_name_the_axes_and_the_unit_once():
    found = [entry(750.0, 700.0, 800.0), entry(990.0, 900.0, 1080.0), OPEN]
    assert parameter_value({"per": ["axis"]}, found) == "x 750 ± 50, y 990 ± 90 Hz, z not determined"
    assert parameter_value({"per": ["axis"]}, [OPEN] * 3) == NOT_IDENTIFIED
    pitch = [entry(0.2, 0.1, 0.3, "deg"), entry(-0.2, -0.3, -0.1, "deg")]
    assert parameter_value({"per": ["tooth"]}, pitch) == "0.20 ± 0.10, −0.20 ± 0.10°"


def test_an_effect_is_named_with_its_joint_and_its_parameters():
    whole = {"effect": "stiffness_scale", "parameters": {"joint": 4, "factor": OPEN | {"unit": "1"}}}
    assert effect_words(whole) == "stiffness scale (joint 4, factor not determined)"
    whole["parameters"] = {"joint": "all", "factor": entry(0.8, 0.7, 0.9, "1")}
    assert effect_words(whole) == "stiffness scale (all joints, factor 0.80 ± 0.10)"
