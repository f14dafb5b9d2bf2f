"""The modes in the report: table, responses with their error, stabilisation diagram."""

import numpy as np
import pandas as pd
import synthetic_results as synthetic

from metro.report.content import Picture, Table
from metro.report.figures import modal
from metro.report.sections.modes import modes


def diagram():
    return pd.DataFrame(
        {
            "position": "1",
            "direction": "x",
            "order": [8, 10, 12, 8, 10, 12],
            "frequency_hz": [35.0, 35.1, 35.2, 50.0, 60.0, 70.0],
            "recurs": [True, True, True, False, False, False],
        }
    )


def used():
    frequency = np.linspace(20, 80, 50)
    rows = [
        pd.DataFrame(
            {"reference": "1x", "response": r, "frequency_hz": frequency, "measured_m_n": m, "modal_m_n": m}
        )
        for r, m in (("1x", 2e-6), ("2x", 3e-6), ("2y", 5e-6))
    ]
    return pd.concat(rows).assign(position="1", error=0.034)


def test_the_diagram_shows_every_pole_at_its_order_over_the_responses_of_its_direction():
    axes, behind = modal.stabilisation(diagram(), used()).axes
    drawn = {line.get_label(): line for line in axes.get_lines()}
    assert drawn["recurring pole"].get_xdata().tolist() == [35.0, 35.1, 35.2]
    assert drawn["other pole"].get_ydata().tolist() == [8, 10, 12]
    np.testing.assert_allclose(behind.get_lines()[0].get_ydata(), 5e-6)
    assert axes.get_xlabel() == "frequency (Hz)"


def test_each_response_names_what_the_modes_leave_of_it():
    titles = [axes.get_title(loc="left") for axes in modal.responses(used()).axes]
    assert "position 1: 1x → 1x (3.4 %)" in titles


def test_a_mode_that_is_not_resolved_is_marked():
    found = 2 * synthetic.identified()["modes"]
    marked = [{**found[0], "resolved": False}, *found[1:]]
    table = next(item for item in modes(marked, {}) if isinstance(item, Table))
    assert table.rows[0][0].endswith(" *")
    assert not table.rows[1][0].endswith(" *")
    assert "not resolved" in table.caption
    plain = next(item for item in modes(found, {}) if isinstance(item, Table))
    assert "not resolved" not in plain.caption


def test_the_section_has_the_diagram_where_the_batch_has_one():
    tables = synthetic.tables()
    without = [item for item in modes(synthetic.identified()["modes"], tables) if isinstance(item, Picture)]
    tables["stabilisation"] = diagram()
    pictures = [item for item in modes(synthetic.identified()["modes"], tables) if isinstance(item, Picture)]
    assert len(pictures) == len(without) + 1
