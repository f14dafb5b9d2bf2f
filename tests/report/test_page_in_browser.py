"""The campaign's page in a browser: it draws, values are read with keys and mouse, nothing goes wrong."""

import os
import re
import shutil
from pathlib import Path

import pytest
from drawn_page import EVIL, written_page

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
    assert own.locator("#batch-late .plot").count() == 5
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
    charts = page.locator("svg.chart").all()
    assert len(charts) == 3
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
    for _ in range(60):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.closest('summary')?.parentElement.id") == "batch-late":
            break
    page.keyboard.press("Enter")
    page.wait_for_selector("#batch-late .plot")
    for _ in range(20):
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


@pytest.mark.skipif(
    not AXE.is_file(), reason="axe-core is not installed (npm install axe-core, or METRO_AXE)"
)
def test_no_rule_of_axe_is_broken(page):
    page.get_by_role("button", name="Unfold all").click()
    page.evaluate(AXE.read_text(encoding="utf-8"))
    found = page.evaluate("axe.run()")["violations"]
    assert [(rule["id"], [n["html"] for n in rule["nodes"]][:3]) for rule in found] == []
