"""The campaign's page as a file: whole by itself, escaped, small, and with the numbers that were measured."""

import base64
import json
import re
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from drawn_page import EVIL, written_page

from metro.report.page.faces import coarse
from metro.report.page.markup import embedded, tag
from metro.report.page.packing import decimals, fitting, kept, packed

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
    for name, attributes in parsed.elements:
        assert name not in {"link", "iframe", "object", "base"}
        assert attributes.get("src", "data:").startswith("data:")
        link = attributes.get("href", "")
        assert link in ("", "late/report.pdf", "early/report.pdf") or link[1:] in targets
        assert not any(key.startswith("on") or key == "style" for key in attributes)
    policy = next(a["content"] for _, a in parsed.elements if "http-equiv" in a)
    assert policy.startswith("default-src 'none'; img-src data:; script-src 'sha256-")
    assert "https://" not in page
    assert set(re.findall(r"http://[^\"' ]*", page)) == {"http://www.w3.org/2000/svg"}  # a name, no address


def test_what_a_batch_says_of_itself_is_text_and_never_markup(page):
    parsed = Parsed(page)
    assert EVIL in "".join(parsed.texts["h3"])
    assert EVIL not in page
    scripts = [a for name, a in parsed.elements if name == "script"]
    assert len(scripts) == 3  # data of two batches, and the page's own
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
    assert boundary["told"][0].startswith(
        "1000 rpm: 2.00 ± 0.20 mm, chatter at 88.0 Hz (hopf); base model 1.50"
    )
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
    assert (z.shape, len(across), along.tolist()) == ((10, 50), 50, list(np.arange(10.0)))
    assert z.mean() == pytest.approx(3.0 * x.mean())
    assert np.abs(z - 3.0 * across).max() <= 3.0 * 199 / 50 / 2 + 1e-9


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
