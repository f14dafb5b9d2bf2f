"""The campaign's page as a file: whole by itself, escaped, small, and with the numbers that were measured."""

import base64
import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
import synthetic_results as synthetic
from drawn_page import EVIL, written_page

from metro.report.content import Bullets, Table
from metro.report.page.curves import run_curves
from metro.report.page.faces import coarse, face_maps
from metro.report.page.markup import embedded, items_of, tag
from metro.report.page.packing import decimals, fitting, gaps, kept, packed
from metro.report.page.path_errors import path_errors
from metro.report.results import Results

VOID = {"meta", "img", "hr", "br", "link", "input"}


class Parsed(HTMLParser):
    """Elements with their attributes, and the text of each; each must be closed, in its turn."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.open, self.texts = [], [], {}
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, name, attributes):
        self.elements.append((name, dict(attributes)))
        if name not in VOID:
            self.open.append(name)

    def handle_endtag(self, name):
        assert self.open.pop() == name

    def handle_data(self, data):
        self.texts.setdefault(self.open[-1] if self.open else "", []).append(data)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    return written_page(tmp_path_factory.mktemp("page")).read_text(encoding="utf-8")


def unpacked(entry):
    code = np.frombuffer(base64.b64decode(entry["data"]), dtype="<u2").astype(float)
    code[code == 65535] = np.nan
    return entry["low"] + code / 65534 * (entry["high"] - entry["low"])


def plots(page, place):
    data = re.findall(r'<script type="application/json" class="data">(.*?)</script>', page)
    return {plot["title"]: plot for plot in json.loads(data[place])}


def test_nothing_is_loaded_from_elsewhere_and_links_lead_to_reports_and_sections(page):
    parsed = Parsed(page)
    targets = {a["id"] for _, a in parsed.elements if "id" in a}
    beside = ("report.pdf", "report.html", "verdict.json", "identified.json", "provenance.json")
    files = {"", "summary.pdf", *(f"{batch}/{file}" for batch in ("late", "early") for file in beside)}
    for name, attributes in parsed.elements:
        assert name not in {"link", "iframe", "object", "base"}
        assert attributes.get("src", "data:").startswith("data:")
        link = attributes.get("href", "")
        assert link in files or link[1:] in targets
        assert not any(key.startswith("on") or key == "style" for key in attributes)
    assert files <= {"", *(a.get("href") for _, a in parsed.elements)}
    policy = next(a["content"] for _, a in parsed.elements if "http-equiv" in a)
    assert policy.startswith("default-src 'none'; img-src data:; script-src 'sha256-")
    assert "https://" not in page
    assert set(re.findall(r"http://[^\"' ]*", page)) == {"http://www.w3.org/2000/svg"}  # a name, no address


def test_what_a_batch_says_of_itself_is_text_and_never_markup(page):
    parsed = Parsed(page)
    assert EVIL in "".join(parsed.texts["h3"])
    assert EVIL not in page
    scripts = [a for name, a in parsed.elements if name == "script"]
    assert len(scripts) == 4  # what is compared, data of two batches, and the page's own
    assert Parsed(tag("p", EVIL, title='"><b>')).elements == [("p", {"title": '"><b>'})]
    assert json.loads(embedded({"run": "</script><!--"})) == {"run": "</script><!--"}
    assert "<" not in embedded({"run": "</script><!--"})


def test_a_page_of_two_small_batches_is_small(page):
    assert len(page.encode()) < 400_000


def test_errors_and_effects_read_as_in_the_pdf(page):
    cells = Parsed(page).texts["td"]
    for text in ("11.8 ± 1.2 N", "2.10 ± 0.21 N", "radius 9.80 ± 0.50 µm", "9.80"):
        assert any(text in cell for cell in cells), text
    assert page.count("a slot at twice the feed") >= 2


def test_curves_and_boundary_carry_what_was_measured(page):
    drawn = plots(page, 1)
    curve = drawn["Held-out runs: cutting force"]["curves"][0]
    angle = np.arange(0, 360, 3.0)
    assert unpacked(curve["x"]) == pytest.approx(angle, abs=0.01)
    measured, before, after = (unpacked(line["y"]) for line in curve["lines"])
    assert measured == pytest.approx(100 * np.sin(np.deg2rad(angle)), abs=0.002)
    assert (before - measured, after - measured) == (
        pytest.approx(12.0, abs=0.01),
        pytest.approx(1.0, abs=0.01),
    )
    boundary = drawn["Stability boundary"]["curves"][0]
    assert boundary["told"][0].startswith("1000 rpm: 2.00 ± 0.20 mm, chatter at 88.0 Hz; base model 1.50")
    assert [(m["look"], m["y"]) for m in boundary["marks"]] == [("stable", 1.0), ("chatter", 3.0)]


def test_packed_numbers_are_off_by_half_a_step_at_most_and_gaps_stay_gaps():
    values = np.array([-3.0, np.nan, 0.123456, 1000.0])
    back = unpacked(packed(values))
    assert np.isnan(back[1])
    assert np.nanmax(np.abs(back - values)) <= 1003.0 / 131068
    assert np.isnan(unpacked(packed(np.full(3, np.nan)))).all()
    assert unpacked(packed(np.full(3, 7.5))) == pytest.approx(7.5)


def test_thinning_keeps_every_peak_that_is_seen():
    rng = np.random.default_rng(3)
    line, other = rng.normal(size=50_000), np.zeros(50_000)
    line[31_313], other[777] = 40.0, -9.0
    at = kept([line, other])
    assert len(at) <= 802
    assert {0, 777, 31_313, 49_999} <= set(at.tolist())
    for part in np.array_split(np.arange(50_000), 200):
        mine = at[(at >= part[0]) & (at <= part[-1])]
        assert (line[mine].min(), line[mine].max()) == (line[part].min(), line[part].max())
    assert kept([line[:1200]]).tolist() == list(range(1200))


def test_a_face_of_many_points_becomes_means_of_neighbourhoods():
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(200.0), np.arange(10.0)))
    across, along, z = coarse(pd.DataFrame({"x_mm": x, "y_mm": y, "deviation_um": 3.0 * x}))
    assert (z.shape, len(across), along.tolist()) == ((10, 100), 100, list(np.arange(10.0)))
    assert z.mean() == pytest.approx(3.0 * x.mean())
    assert np.abs(z - 3.0 * across).max() <= 3.0 * 199 / 100 / 2 + 1e-9


def test_a_face_that_fits_is_drawn_as_it_was_measured_and_its_extremes_are_always_of_all_places(page):
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(60.0), np.arange(35.0)))
    known = pd.DataFrame({"x_mm": x, "y_mm": y, "deviation_um": np.sin(7.0 * x + y)})
    assert coarse(known)[2].ravel() == pytest.approx(known["deviation_um"].to_numpy())
    z = np.zeros(2000)
    z[777] = 90.0
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(1000.0), np.arange(2.0)))
    large = pd.DataFrame({"run": "r1", "x_mm": x, "y_mm": y, "deviation_um": z + 0.01 * x})
    drawn = face_maps(Results(None, {"face_map": large}, {}, {}, {}), 400_000)["curves"][0]["layers"][0]
    assert drawn["told"] == "from 0 to 97.8"
    assert unpacked(drawn["z"]).max() < 20.0  # the mean of a neighbourhood


def test_all_faces_of_a_batch_have_one_limit_of_colours_and_each_its_own(page):
    plot = plots(page, 1)["Faces, all runs"]
    whole = np.concatenate([unpacked(face["layers"][0]["z"]) for face in plot["curves"]])
    assert plot["limit"] == pytest.approx(np.quantile(np.abs(whole), 0.98), rel=1e-3)
    own = [face["layers"][0]["limit"] for face in plot["curves"]]
    assert (own[0], own[1]) == (pytest.approx(4 * own[1]), pytest.approx(own[0] / 4))
    assert own[1] < plot["limit"] < own[0]
    assert (plot["mm"], plot["first"]) == (1e-3, ["r1"])


def test_a_gap_is_eight_usual_steps_and_is_kept_when_a_curve_is_thinned():
    x = np.concatenate([np.arange(3000.0), np.arange(5000.0, 6000.0)])
    assert gaps(x).tolist() == [3000]
    assert gaps(np.array([0.0, 1.0, 2.0, 9.9, 10.9])).size == 0
    assert gaps(np.array([0.0, 1.0, 2.0, 10.1, 11.1])).tolist() == [3]
    assert gaps(np.ones(3)).size == 0
    at = kept([np.sin(x)], gaps(x))
    assert {2999, 3000} <= set(at.tolist())
    assert len(at) < 1000


def test_where_nothing_was_measured_a_curve_is_broken_and_the_run_missed_most_comes_first(page):
    plot = plots(page, 0)["Held-out runs: waviness of the wall"]
    assert [curve["gaps"] for curve in plot["curves"]] == [[40], [40]]
    assert plot["first"] == ["w2", "z", "all"]
    assert plot["options"] == {"w1": "w1: rms 0.200 → 0.100 µm", "w2": "w2: rms 0.800 → 0.100 µm"}
    assert plot["curves"][1]["said"] == "w2, along z"


def test_one_value_per_axis_makes_one_plot_over_the_axes(page):
    plot = plots(page, 0)["Held-out runs: cutting force"]
    (curve,) = plot["curves"]
    assert (plot["x"], curve["rows"]) == ("axis", ["x", "y", "z"])
    assert unpacked(curve["lines"][0]["y"]) == pytest.approx([78.0, -176.0, -35.0], abs=0.01)


@pytest.mark.parametrize(
    ("run", "rows"), [("table 6, 71–73", ["71", "72", "73"]), ("table 6, 71–75", ["1", "2", "3"])]
)
def test_places_of_a_table_are_named_by_the_printed_rows_where_these_are_known(run, rows):
    blank = dict.fromkeys(("t_s", "angle_deg", "s_mm", "x_mm", "y_mm"), np.nan)
    frame = pd.DataFrame(
        {"observable": "flatness", "run": run, "axis": "z", **blank, "measured": [1.0, 2.0, 3.0],
         "before": 1.0, "after": 1.0, "sigma": 0.1, "unit": "mm"}
    )  # fmt: skip
    drawn = run_curves(Results(None, {"comparison": frame}, {}, {}, {}), "flatness", 10_000)
    assert (drawn["x"], drawn["curves"][0]["rows"]) == ("row of the table", rows)


def test_responses_are_logarithms_of_the_measured_and_of_the_modal_receptance(page):
    plot = plots(page, 0)["Frequency responses"]
    assert (plot["first"], plot["log"]) == (["1", "1x → 2x"], True)
    measured, modal = (unpacked(line["y"]) for line in plot["curves"][1]["lines"])
    hz = unpacked(plot["curves"][1]["x"])
    exact = np.abs(1e-8 / (1 - (hz / 120.0) ** 2 + 0.04j * hz / 120.0))
    assert 10.0**measured == pytest.approx(exact, rel=1e-3)
    assert modal - measured == pytest.approx(np.full(200, np.log10(1.01)), abs=1e-4)


@pytest.mark.parametrize("idle", [1.0, np.nan])
def test_the_tips_path_error_is_drawn_with_that_of_the_joint_with_the_largest_share(idle):
    x = np.arange(0.0, 40.0, 0.16)
    points = pd.DataFrame({"run": "r1", "x_mm": x})
    for i in range(1, 7):
        points[f"strayed{i}_um"] = i * np.sin(x)
        points[f"strayed_idle{i}_um"] = idle * np.cos(x)
    shares = {"arm": {"waviness": {"r1": {"joint_share": [0.0, 0.1, 0.7, 0.2, 0.0, 0.0]}}}}
    results = replace(synthetic.results(), tables={"waviness_points": points}, identified=shares)
    [curve] = path_errors(results, 10**6)["curves"]
    assert curve["said"] == "r1: joint 3 makes 70 % of the waves"
    lines = {line["name"]: unpacked(line["y"]) for line in curve["lines"]}
    assert lines.pop("tip in the cut") == pytest.approx(21 * np.sin(x), abs=1e-3)
    assert lines.pop("joint 3 alone") == pytest.approx(3 * np.sin(x), abs=1e-3)
    if idle == 1.0:
        assert lines.pop("tip in the idle run") == pytest.approx(6 * np.cos(x), abs=1e-3)
    assert lines == {}
    assert path_errors(replace(results, tables={}), 10**6) is None


def test_names_of_batches_lead_to_them_and_values_stay_with_their_intervals():
    table = Table(["reason", "batches"], [["a mean of 9.80 ± 0.30 mm over all of it", "b1, other"]], "c")
    made = items_of([Bullets(["b1, cutting force: b1 again"]), table], {"b1": "#batch-b1"})
    assert '<li><a href="#batch-b1">b1</a>, cutting force: b1 again</li>' in made
    assert '<td class="long"><a href="#batch-b1">b1</a>, other</td>' in made
    assert "a mean of 9.80\u00a0±\u00a00.30\u00a0mm over" in made
    assert "tabindex" not in made  # only what scrolls is a stop: the page finds out itself


def test_what_does_not_fit_is_left_out_by_worth_and_the_order_stays():
    entries = [{"run": name, "data": "x" * 100} for name in "abcd"]
    assert [e["run"] for e in fitting(entries, 260, [1.0, 4.0, 2.0, 3.0])] == ["b", "d"]
    assert len(fitting(entries, 10, [1.0] * 4)) == 1
    assert fitting(entries, 10_000, [1.0] * 4) == entries


@pytest.mark.parametrize(
    ("half", "largest", "digits"), [(0.3, 10, 2), (12.0, 300, 0), (450.0, 9000, -1), (np.nan, 0.05, 4)]
)
def test_values_are_read_to_two_digits_of_their_interval(half, largest, digits):
    assert decimals(half, largest) == digits
