"""Raw records in the report: what of each was used, which has no air, and how far the hits reach."""

from dataclasses import replace

import numpy as np
import pandas as pd
import synthetic_results as synthetic

from metro.report.figures import records as figures
from metro.report.sections.records import record_items
from metro.report.sections.terms import terms

TIME = np.linspace(0.0, 2.0, 50)


def spans(names=("r1", "r2", "r3")):
    return pd.concat(
        pd.DataFrame({"run": run, "t_s": TIME, "axis": axis, "low_n": -size, "high_n": 2.0 * size})
        for run in names
        for axis, size in (("x", 5.0), ("y", 40.0), ("z", 1.0))
    )


def spindle():
    return pd.DataFrame(
        {
            "run": ["r1", "r2"],
            "steady_from_s": [0.5, 0.0],
            "steady_to_s": [1.8, 2.0],
            "air_s": [0.3, 0.0],
            "zero_at_s": [0.1, 0.0],
        }
    )


def hits(reach):
    frequency = np.linspace(10, 5000, 500)
    level = -20.0 * frequency / reach
    spectrum = pd.DataFrame({"hit": "h, 1", "part": "spectrum", "x": frequency, "value": level})
    pulse = pd.DataFrame({"hit": "h, 1", "part": "pulse", "x": [-1.0, 0.0, 1.0], "value": [0.0, 200.0, 0.0]})
    return pd.concat([pulse, spectrum])


def items(**tables):
    batch = synthetic.batch()
    runs = batch.runs.assign(dynamometer="a.csv")
    return record_items(replace(synthetic.results(), batch=replace(batch, runs=runs), tables=tables))


def test_the_caption_says_what_was_used_of_the_records_and_what_has_no_air():
    (picture,) = items(force_records=spans(), spindle=spindle())
    assert "Of 2 of 3 records the steady cut was used; of r3 nothing was" in picture.caption
    assert "1 record without air" in picture.caption
    assert "3 of 10 records" in picture.caption


def test_each_panel_spans_the_force_of_the_strongest_axis_and_shades_what_was_used():
    figure = figures.force(spans(), spindle())
    panel, _, unused = figure.axes[:3]
    assert figure.get_supylabel() == "force along y (N)"
    extent = panel.collections[0].get_datalim(panel.transData)
    assert (extent.y0, extent.y1) == (-40.0, 80.0)
    (used,) = panel.patches
    assert (used.get_x(), used.get_x() + used.get_width()) == (0.5, 1.8)
    assert [line.get_xdata()[0] for line in panel.get_lines()] == [0.1]
    assert not unused.patches


def test_the_caption_of_the_hits_says_how_far_their_force_reaches_and_where_modes_were_fitted():
    fitted = pd.DataFrame({"frequency_hz": [60.0, 3000.0]})
    (picture,) = items(hit_records=hits(1500.0), frf_used=fitted)
    assert "The force of 1 hit is down by 20 dB at 15" in picture.caption
    assert "modes were fitted from 60.0 to 3000 Hz" in picture.caption
    (strong,) = items(hit_records=hits(50_000.0))
    assert "within 20 dB up to 5000 Hz" in strong.caption


def test_the_terms_are_those_that_the_report_uses():
    whole = terms(synthetic.results())
    told = dict(whole.items[1].rows)
    assert {"noise floor", "p, q", "explained", "P(chatter)", "MAC", "X_m, X_a, X_g"} <= set(told)
    bare = terms(replace(synthetic.results(), verdict={"observables": {}}, identified={}, tables={}))
    assert [row[0] for row in bare.items[1].rows] == ["held out", "error", "noise floor"]
    clean = {"observables": {"force": synthetic.observable("clean")}}
    verdicts = set(dict(terms(replace(synthetic.results(), verdict=clean)).items[1].rows))
    assert "clean" in verdicts
    assert not verdicts & {"explained", "unexplained", "undetermined"}
