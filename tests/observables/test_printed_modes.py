"""Printed modes and coefficients as if they had been identified."""

import numpy as np
import pandas as pd

from metro.batch.batch import Batch
from metro.dynamics.lobes import stability_boundary
from metro.dynamics.system import Cut, Structure
from metro.observables.published.modes import printed_coefficients, printed_modes
from metro.observables.stability import observable as lobes

# table 6, position 1: damped frequency, damping (%), stiffness, mass
TABLE_6 = {
    ("x", 1): (21.3257, 6.08951, 7.25548e6, 402.61), ("x", 2): (34.6937, 7.07726, 4.05902e6, 84.9923),
    ("x", 3): (56.6075, 3.5692, 4.18385e6, 33.0305), ("x", 4): (65.5141, 6.33944, 2.21663e6, 13.0291),
    ("z", 1): (31.4277, 6.71896, 3.1541e8, 8052.43), ("z", 2): (35.0952, 4.76042, 7.06418e7, 1449.51),
    ("z", 3): (54.7344, 4.99933, 4.71786e7, 397.904), ("z", 4): (67.2582, 3.79608, 1.46188e7, 81.7399),
}  # fmt: skip
TABLE_4 = {"K_tc": 10145, "K_rc": 11036.5, "K_ac": 5000, "K_te": 591.92, "K_re": 100.03, "K_ae": 214.32}


def published():
    rows = [
        {"observable": "lobes", "row": f"mode {number}", "axis": axis, "quantity": quantity,
         "measured": value, "note": "table 6, section 4.2, position 1"}
        for (axis, number), values in TABLE_6.items()
        for quantity, value in zip(("frequency", "damping", "stiffness", "mass"), values, strict=True)
    ]  # fmt: skip
    more = [
        {"observable": "force", "row": name, "quantity": "cutting coefficient", "measured": value, "note": ""}
        for name, value in TABLE_4.items()
    ]
    return pd.DataFrame(rows + more)


def observed():
    runs = pd.DataFrame(
        {
            "role": "", "condition": "a", "operation": "helical", "direction": np.nan, "spindle_rpm": 2000.0,
            "axial_depth_mm": 0.2, "radial_depth_mm": np.nan, "feed_per_tooth_mm": 0.06,
            "feed_direction_deg": np.nan, "pose": np.nan, "stable": "",
        },
        index=pd.Index(["figure-12"], name="run"),
    )  # fmt: skip
    tool = {"tool": {"diameter_mm": 12, "teeth": 4, "helix_deg": 40}}
    batch = Batch("printed", tool, {"cell": "c"}, runs, {})
    columns = ["test", "position", "reference", "response", "replicate", "response_unit", "t_s"]
    empty = pd.DataFrame(columns=[*columns, "force_n", "response_si", "frequency_hz", "real_m_n", "imag_m_n"])
    stations = pd.DataFrame(columns=["position", "x_mm", "y_mm", "z_mm"])
    source = {"hit": empty, "frf": empty, "stations": stations, "published": published(), "pickups": empty}
    return lobes.observe(batch, lambda name: source[name], {})


def test_the_frequency_is_the_undamped_one():
    modes = printed_modes(published())
    assert set(modes["position"]) == {"1"}
    printed = np.array([values[0] for values in TABLE_6.values()])
    order = np.argsort(printed)
    undamped = np.sort(modes["frequency_hz"]) * np.sqrt(
        1 - modes["damping"].iloc[np.argsort(modes["frequency_hz"])] ** 2
    )
    np.testing.assert_allclose(undamped, printed[order], rtol=1e-5)


def test_an_incomplete_table_has_no_modes():
    assert printed_modes(published().query("quantity != 'mass'")).empty


def test_coefficients_go_by_their_names_in_the_contract():
    found = printed_coefficients(published())["force"]["waveform"]
    assert found["ktc"] == {"value": 10145.0}
    assert set(found) == {"ktc", "krc", "kac", "kte", "kre", "kae"}
    assert printed_coefficients(published().iloc[:4]) == {}


def test_the_diagram_of_the_published_machine_is_drawn_from_what_is_printed():
    tables = observed()
    diagram = tables["lobes"]
    zeta, k, m = (np.array([v[i] for v in TABLE_6.values()]) for i in (1, 2, 3))
    axis = np.array([0 if letter == "x" else 1 for letter, _ in TABLE_6])
    structure = Structure(axis, np.sqrt(k / m), zeta / 100, k)
    exact = stability_boundary(structure, Cut(4, 0.0, np.pi, 10145e6, 11036.5e6), diagram["rpm"]).depth
    np.testing.assert_allclose(diagram["depth_mm"], exact * 1e3, rtol=1e-6)
    assert diagram["rpm"].min() == 500
    assert diagram["rpm"].max() == 2500
    methods = tables["lobe_methods"]
    checked = methods[methods["checked"]]
    np.testing.assert_allclose(checked["semidiscretisation_mm"], checked["depth_mm"], rtol=1e-3)
    # what the source says of its figure 18: above 1000 rpm modes 2, 3 and 4 govern, rising with speed
    fast = methods[methods["rpm"] > 1000]
    assert set(fast["governing_mode"]) <= {"x2", "x3", "x4"}
    assert list(fast["governing_mode"]) == sorted(fast["governing_mode"])
    assert any("as printed" in reason for reason in tables["lobes_refused"]["reason"])
