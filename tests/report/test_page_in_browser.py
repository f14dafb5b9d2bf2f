"""The campaign's page in a browser: it draws, values are read with keys and mouse, nothing goes wrong."""

import csv
import io
import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from drawn_page import EVIL, written_page
from matplotlib import image

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
AXE = Path(os.environ.get("METRO_AXE", Path(__file__).parents[2] / "node_modules/axe-core/axe.min.js"))

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
pytestmark = pytest.mark.skipif(BROWSER is None, reason="no Chromium is installed")


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    return written_page(tmp_path_factory.mktemp("browser")).as_uri()


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@pytest.fixture
def page(browser, address):
    """Open the page with a batch unfolded; what the console says or a network is asked for fails the test."""
    wrong = []
    opened = browser.new_page(viewport={"width": 1100, "height": 900}, bypass_csp=True)
    opened.on("console", lambda message: wrong.append(message.text))
    opened.on("pageerror", lambda error: wrong.append(str(error)))
    opened.on(
        "request", lambda asked: wrong.append(asked.url) if asked.url[:5] not in ("file:", "data:") else None
    )
    opened.goto(f"{address}#batch-late")
    opened.wait_for_selector("#batch-late .plot")
    yield opened
    opened.close()
    assert wrong == []


def plot(page, title):
    return page.locator("figure.plot").filter(has=page.get_by_role("heading", name=title))


def read(page, title):
    return plot(page, title).locator("output").inner_text()


def test_the_policy_lets_the_pages_own_script_run_and_no_other(browser, address):
    own = browser.new_page()
    said = []
    own.on("console", lambda message: said.append(message.text))
    own.goto(f"{address}#batch-late")
    assert own.locator("#batch-late .plot").count() == 6
    assert said == []
    assert own.title() == "Campaign summary"
    assert EVIL in own.locator("#batch-early summary").first.inner_text()
    own.evaluate(
        "document.body.append(Object.assign(document.createElement('script'), {text: 'document.title=1'}))"
    )
    assert own.title() == "Campaign summary"
    assert any("Content Security Policy" in line for line in said)
    own.close()


def test_every_plot_is_drawn(page):
    charts = page.locator("#batch-late svg.chart").all()
    assert len(charts) == 4
    for chart in charts:
        paths = [p.get_attribute("d") for p in chart.locator("path.line").all()]
        assert all(len(d) > 100 and "NaN" not in d for d in paths)
    for i in range(2):
        colours = (
            page.locator("canvas.face")
            .nth(i)
            .evaluate(
                "c => new Set(new Uint32Array("
                "c.getContext('2d').getImageData(0, 0, c.width, c.height).data.buffer)).size"
            )
        )
        assert colours > 50


def test_links_lead_to_sections_and_reports(page, address):
    page.goto(address)
    page.get_by_role("link", name="late", exact=True).first.click()
    assert page.locator("#batch-late").get_attribute("open") is not None
    for link in page.locator("a[href$='.pdf']").all():
        target = link.evaluate("a => a.href")
        assert Path(target.removeprefix("file://")).read_bytes().startswith(b"%PDF")


def test_a_batch_is_unfolded_and_a_boundary_read_with_keys_alone(page, address):
    page.goto("about:blank")
    page.goto(address)
    for _ in range(80):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.closest('summary')?.parentElement.id") == "batch-late":
            break
    page.keyboard.press("Enter")
    page.wait_for_selector("#batch-late .plot")
    for _ in range(30):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.getAttribute('aria-label')") == "Stability boundary":
            break
    assert read(page, "Stability boundary").startswith("1500 rpm: 2.00 ± 0.20 mm")
    page.keyboard.press("ArrowRight")
    assert read(page, "Stability boundary").startswith("1550 rpm")
    page.keyboard.press("ArrowUp")
    assert read(page, "Stability boundary").startswith("Test cut c1: 1.00 mm at 1000 rpm: stable")


def ticks(page, title):
    return [t.text_content() for t in plot(page, title).locator("svg text.middle").all()]


def test_a_waveform_is_seen_larger_with_keys_and_mouse_and_whole_again(page):
    name = "Held-out runs: cutting force"
    whole = ticks(page, name)
    chart = plot(page, name).locator("svg.chart")
    chart.focus()
    for _ in range(3):
        page.keyboard.press("+")
    assert ticks(page, name) != whole
    page.keyboard.press("Home")
    assert ticks(page, name) == whole
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 50)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 60, steps=3)
    page.mouse.up()
    assert ticks(page, name) != whole
    chart.dblclick()
    assert ticks(page, name) == whole


def test_a_value_is_read_under_the_mouse(page):
    name = "Held-out runs: cutting force"
    chart = plot(page, name).locator("svg.chart")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    scale = box["width"] / 760
    page.mouse.move(box["x"] + scale * (66 + 680 * 90 / 357), box["y"] + 100 * scale)
    angle, measured, before = re.match(
        r"spindle angle (\d+) °: measured ([\d.]+) ± [\d.]+ N; base model ([\d.]+) N", read(page, name)
    ).groups()
    assert (angle, float(measured), float(before)) == ("90", 100.0, 112.0)


def test_another_axis_is_chosen_and_the_choice_keeps_the_focus(page):
    choice = plot(page, "Held-out runs: cutting force").get_by_label("axis")
    choice.focus()
    choice.select_option("y")
    assert page.evaluate("document.activeElement.value") == "y"


def test_a_face_is_turned_and_read_with_keys(page):
    name = "Faces, all runs"
    canvas = plot(page, name).locator("canvas")
    canvas.focus()
    before, start = canvas.evaluate("c => c.toDataURL()"), read(page, name)
    page.keyboard.press("ArrowLeft")
    turned = canvas.evaluate("c => c.toDataURL()")
    assert turned != before
    assert read(page, name) == start
    page.keyboard.press("Shift+ArrowRight")
    assert start.startswith("x 0.0 mm, y 0.0 mm: 0.0")
    assert read(page, name).startswith("x 1.0 mm, y 0.0 mm: 3.3")
    page.keyboard.press("Shift+ArrowLeft")
    page.keyboard.press("Home")
    assert canvas.evaluate("c => c.toDataURL()") == before


def unfolded(page, batch):
    page.locator(f"#batch-{batch} > summary").click()
    page.wait_for_selector(f"#batch-{batch} .plot")


def test_a_line_is_broken_where_nothing_was_measured(page):
    unfolded(page, "early")
    chart = plot(page, "Held-out runs: waviness of the wall").locator("svg.chart")
    parts = [p.get_attribute("d").count("M") for p in chart.locator("path.line").all()]
    assert parts == [2] * 6  # three lines; below them zero, and what either prediction leaves
    assert [p.get_attribute("d").count("M") for p in chart.locator("path.area").all()] == [2, 2]


def test_one_value_per_axis_is_a_mark_with_its_interval(page):
    unfolded(page, "early")
    name = "Held-out runs: cutting force"
    here = page.locator("#batch-early figure.plot").filter(has=page.get_by_role("heading", name=name))
    chart = here.locator("svg.chart")
    assert chart.locator("g > .mark.measured").count() == 3
    assert chart.locator("g > .mark.before").count() == 6  # and what is left over
    assert [bar.get_attribute("d").count("L") for bar in chart.locator("path.bar").all()] == [3, 3]
    assert chart.locator("path.line.measured").count() == 0
    assert [t.text_content() for t in chart.locator("text.middle").all()][:3] == ["x", "y", "z"]
    assert here.locator("output").inner_text() == (
        "axis y: measured −176.0 ± 2.0 N; base model (nothing added) −156.0 N; residual: −20.0 N "
        "(table 7, test 2)"
    )


def test_a_peak_above_the_frame_is_pointed_at_and_seen_when_zoomed_into(page):
    here = plot(page, "Stability boundary")
    note = here.get_by_text("goes on above")
    assert here.locator("svg .beyond").count() == 2
    assert note.is_visible()
    here.locator("svg.chart").focus()
    for _ in range(6):
        page.keyboard.press("ArrowRight")
    assert read(page, "Stability boundary").startswith("1800 rpm: 20.0 ± 2.0 mm")
    page.keyboard.press("+")
    assert here.locator("svg .beyond").count() == 0
    assert not note.is_visible()
    assert "20" in [t.text_content() for t in here.locator("svg text.end").all()]
    page.keyboard.press("Home")
    assert here.locator("svg .beyond").count() == 2


def test_what_is_left_over_is_read_and_only_what_keys_lead_to_is_spoken(page):
    name = "Held-out runs: cutting force"
    chart, spoken = plot(page, name).locator("svg.chart"), plot(page, name).locator(".unseen")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 60)
    assert "residual: base model −12.0 N, with effects found −1.0 N" in read(page, name)
    assert spoken.text_content() == ""
    chart.focus()
    page.keyboard.press("End")
    assert spoken.text_content() == read(page, name)
    assert read(page, name).startswith("spindle angle 357 °")
    assert read(page, name).endswith("(r1, along x)")
    assert chart.get_attribute("aria-label") == f"{name}: r1, along x"


def test_a_drag_past_the_edge_shows_the_part_up_to_it_and_another_axis_keeps_it(page):
    name = "Held-out runs: cutting force"
    chart = plot(page, name).locator("svg.chart")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    page.mouse.move(box["x"] + 0.8 * box["width"], box["y"] + 50)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] + 60, box["y"] + 60, steps=4)
    page.mouse.up()
    seen, told = ticks(page, name), read(page, name).partition(":")[0]
    assert seen[0] == "290"
    assert "350" in seen
    plot(page, name).get_by_label("axis").select_option("y")
    assert (ticks(page, name), read(page, name).partition(":")[0]) == (seen, told)


def test_a_face_is_turned_by_drag_and_coloured_by_itself(page):
    here = plot(page, "Faces, all runs")
    canvas = here.locator("canvas")
    picture = "c => c.toDataURL()"
    assert canvas.evaluate("c => getComputedStyle(c).touchAction") == "none"
    toggle = here.get_by_role("button", name="Scale to this face")
    first = canvas.evaluate(picture)
    toggle.click()
    assert toggle.get_attribute("aria-pressed") == "true"
    assert canvas.evaluate(picture) != first
    toggle.click()
    assert canvas.evaluate(picture) == first
    box = canvas.bounding_box()
    page.mouse.move(box["x"] + 100, box["y"] + 100)
    page.mouse.down()
    page.mouse.move(box["x"] + 160, box["y"] + 110)
    page.mouse.up()
    assert canvas.evaluate(picture) != first


def test_a_link_unfolds_its_batch_again_after_all_were_folded(page, address):
    batch = page.locator("#batch-late")
    link = page.locator("a[href='#batch-late']").first
    link.click()
    page.get_by_role("button", name="Fold all", exact=True).click()
    assert batch.get_attribute("open") is None
    link.click()
    assert batch.get_attribute("open") is not None


def test_paper_gets_every_plot_and_the_page_is_folded_again_after_it(page):
    assert page.locator("#batch-early .plot").count() == 0
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.locator("details.batch[open]").count() == 2
    assert page.locator("#batch-early .plot").count() == 4
    page.emulate_media(media="print")
    assert not page.get_by_role("button", name="Larger").first.is_visible()
    assert plot(page, "Faces, all runs").locator("h4 small").inner_text() == "r1, measured, less its plane"
    page.emulate_media(media="screen")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.locator("#batch-early").get_attribute("open") is None
    assert page.locator("#batch-late").get_attribute("open") is not None


def test_verdicts_are_sifted_and_sorted(page):
    table = page.locator("table[data-verdicts]")
    rows = table.locator("tbody tr:visible")
    assert rows.count() == 5
    page.get_by_role("button", name="needs attention 1").click()
    assert rows.count() == 1
    assert "waviness" in rows.first.inner_text()
    page.get_by_role("button", name="all 5").click()

    def column(i):
        return [row.locator("td").nth(i).inner_text() for row in rows.all()]

    head = table.get_by_role("columnheader", name="observable")
    head.get_by_role("button").click()
    assert head.get_attribute("aria-sort") == "ascending"
    assert column(1) == sorted(column(1))
    head.get_by_role("button").click()
    assert head.get_attribute("aria-sort") == "descending"
    assert column(1) == sorted(column(1), reverse=True)


def test_text_of_plots_is_readable_on_a_telephone(page):
    page.set_viewport_size({"width": 420, "height": 800})
    page.wait_for_timeout(200)
    for chart in page.locator("svg.chart").all():
        assert chart.locator("text").first.evaluate("t => t.getBoundingClientRect().height") > 11
    for canvas in page.locator("canvas.face").all():
        shown, drawn = canvas.evaluate("c => [c.getBoundingClientRect().width, c.width]")
        assert drawn == pytest.approx(shown, abs=1)
    assert page.evaluate("document.documentElement.scrollWidth") <= 420
    value = plot(page, "Stability boundary").locator("output .short").first
    assert (value.inner_text(), value.evaluate("v => v.getClientRects().length")) == ("2.00 ± 0.20", 1)
    assert page.locator(".scroll[tabindex='0']").count() >= 1
    page.set_viewport_size({"width": 1100, "height": 800})
    page.wait_for_timeout(200)
    assert page.locator(".scroll[tabindex='0']").count() == 0


@pytest.mark.skipif(
    not AXE.is_file(), reason="axe-core is not installed (npm install axe-core, or METRO_AXE)"
)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_no_rule_of_axe_is_broken(page, scheme):
    page.emulate_media(color_scheme=scheme)
    page.get_by_role("button", name="Unfold all").click()
    page.evaluate(AXE.read_text(encoding="utf-8"))
    found = page.evaluate("axe.run()")["violations"]
    assert [(rule["id"], [n["html"] for n in rule["nodes"]][:3]) for rule in found] == []


def test_what_does_not_hold_the_words_searched_for_is_hidden(page):
    page.get_by_label("Search").fill("waviness early")
    assert not page.locator("#batch-late").is_visible()
    assert page.locator("#batch-early").is_visible()
    assert page.get_by_text("1 of 2 batches").is_visible()
    page.get_by_label("Search").fill("")
    assert page.locator("#batch-late").is_visible()


def test_errors_are_sorted_among_those_of_their_unit(page):
    table = page.locator("table[data-verdicts]").first
    for _ in ("rising", "falling"):
        table.get_by_role("button", name="after").click()
        units = [cell.inner_text() for cell in table.locator("tbody td:nth-child(6)").all()]
        assert units == ["N", "N", "µm", "mm", "1"]


def test_a_verdict_is_seen_on_a_telephone(browser, address):
    small = browser.new_page(viewport={"width": 420, "height": 900})
    small.goto(address)
    badges = small.locator("table[data-verdicts] .badge").all()
    assert len(badges) == 5
    assert all(box["x"] + box["width"] <= 420 for box in (badge.bounding_box() for badge in badges))
    assert small.evaluate("document.documentElement.scrollWidth") == 420
    small.close()


def test_two_batches_are_compared_by_what_both_identified(page):
    section = page.locator(".compare")
    assert section.get_by_label("first batch").input_value() == "early"
    assert section.get_by_text("1 of 7 shared quantities differ").is_visible()
    row = section.get_by_role("row", name=re.compile("^K_tc"))
    assert [cell.inner_text() for cell in row.locator("td").all()] == [
        *("K_tc", "850.0\u00a0±\u00a05.0 N/mm²", "900.0\u00a0±\u00a05.0 N/mm²", "1.06", "differs"),
    ]
    section.get_by_label("first batch").select_option("late")
    assert section.get_by_text("0 of").is_visible()


def test_a_cut_is_tried_with_sliders_and_marked_on_the_boundary(page):
    here = plot(page, "Try a cut")
    said = here.locator("p.tried")
    before = float(re.search(r"axis ([\d.]+) ±", said.inner_text())[1])
    assert "predicted to be stable" in said.inner_text()
    here.get_by_label("axial depth").fill("3")
    after = float(re.search(r"axis ([\d.]+) ±", said.inner_text())[1])
    assert after > 2 * before
    assert "predicted to chatter" in said.inner_text()
    assert plot(page, "Stability boundary").locator("g .mark.tried").count() == 1
    here.get_by_label("spindle speed").fill("1800")
    assert "predicted to be stable" in said.inner_text()


def test_the_page_is_dark_where_the_reader_asks_for_it(browser, address):
    dark = browser.new_page(color_scheme="dark")
    dark.goto(address)
    ground = dark.evaluate("getComputedStyle(document.documentElement).backgroundColor")
    assert max(int(part) for part in re.findall(r"\d+", ground)) < 50
    dark.close()


def saved(page, title, what):
    with page.expect_download() as waited:
        plot(page, title).get_by_role("button", name=what).click()
    return waited.value.suggested_filename, Path(waited.value.path()).read_bytes()


def test_the_numbers_of_a_plot_are_saved_as_a_table(page):
    name, content = saved(page, "Held-out runs: cutting force", "Save data")
    assert name == "late-Held-out-runs-cutting-force-r1-along-x.csv"
    head, *rows = list(csv.reader(content.decode().splitlines()))
    assert head == [
        *("spindle angle (°)", "measured", "measured, lower 95 %", "measured, upper 95 %"),
        *("base model", "with effects found"),
    ]
    values = np.array(rows, dtype=float)
    at = values[:, 0] == 90.0
    assert values[at] == pytest.approx(np.array([[90.0, 100.0, 98.04, 101.96, 112.0, 101.0]]), abs=0.1)


def test_the_heights_of_a_face_are_saved_as_a_table(page):
    name, content = saved(page, "Faces, all runs", "Save data")
    assert name == "late-Faces-all-runs-r1-measured-less-its-plane.csv"
    head, *rows = list(csv.reader(content.decode().splitlines()))
    assert head == ["x (mm)", "y (mm)", "height (µm)"]
    assert len(rows) > 100


@pytest.mark.parametrize("title", ["Stability boundary", "Faces, all runs"])
def test_the_drawing_of_a_plot_is_saved_as_a_picture(page, title):
    name, content = saved(page, title, "Save picture")
    assert re.fullmatch(r"late-.*\.png", name)
    picture = image.imread(io.BytesIO(content), format="png")
    assert min(picture.shape[:2]) > 300
    assert len(np.unique(picture.reshape(-1, picture.shape[2]), axis=0)) > 10  # more than one colour


def test_a_run_is_compared_with_another(page):
    unfolded(page, "early")
    here = page.locator("#batch-early figure.plot").filter(
        has=page.get_by_role("heading", name="Held-out runs: waviness of the wall")
    )
    before = here.locator("path.line.other").count()
    choice = here.get_by_label("compared with")
    choice.select_option(index=1)
    run = choice.input_value()
    assert before == 0
    assert here.locator("svg.chart path.line.other").count() == 2  # the run, and less it
    assert f"measured, {run}" in here.locator("output").inner_text()
    assert f"; difference from {run}: " in here.locator("output").inner_text()
    choice.select_option(index=0)
    assert here.locator("svg.chart path.line.other").count() == 0


def test_a_quantity_is_followed_over_batches(page):
    here = page.locator(".trends figure.plot")
    here.get_by_label("quantity").select_option("K_tc")
    assert here.locator("svg.chart g > .mark.measured").count() == 2
    assert [t.text_content() for t in here.locator("svg text.middle").all()][:2] == ["early", "late"]
    chart = here.locator("svg.chart")
    chart.focus()
    page.keyboard.press("Home")
    page.keyboard.press("End")
    assert here.locator("output").inner_text().startswith("batch late: identified 900.0 ± 5.0 N/mm²")


def test_a_cut_that_is_tried_has_intervals(page):
    said = plot(page, "Try a cut").locator("p.tried").inner_text()
    assert re.search(
        r"axis [\d.]+ ± [\d.]+ N; mean torque [\d.]+ ± [\d.]+ N m; power [\d.]+ ± [\d.]+ W", said
    )
    assert plot(page, "Try a cut").locator("path.area").count() == 3
