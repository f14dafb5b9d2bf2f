"""The campaign's summary."""

import io
import json

import pandas as pd
import pikepdf
import pypdfium2
import pytest
import synthetic_results as synthetic

from metro.batch.batch import Batch
from metro.batch.processed import write_batch
from metro.report.campaign import campaign_report, campaign_table
from metro.report.sections.standings import largest_residuals, rankings
from metro.stages.campaign import campaign

EMPTY = {"format": 1, "batch": "modes-only", "metro": "0", "observables": {}}


def processed(folder, started=""):
    folder.mkdir(parents=True)
    runs = pd.DataFrame({"run": ["r1"], "operation": ["slot"], "role": ["validate"], "started_at": [started]})
    runs = runs.set_index("run")
    manifest = {"cell": "cell-a", "source": "measured"}
    write_batch(folder, Batch(folder.name, manifest, {"cell": "cell-a"}, runs, {}), {})
    (folder / "loop.json").write_text(json.dumps({"observables": {}}))


@pytest.fixture
def verdicts():
    return {"synthetic": synthetic.verdict(), "modes-only": EMPTY}


def test_the_table_has_a_row_per_batch_and_observable_with_errors_and_effects(verdicts):
    table = campaign_table(verdicts).set_index(["batch", "observable"])
    assert len(table) == 4
    row = table.loc[("synthetic", "force")]
    assert (row["before_rms"], row["after_rms"], row["effects"]) == (11.8, 2.1, "tool_runout")
    assert row["before_lo"] == pytest.approx(0.92 * 11.8)
    assert table.loc[("synthetic", "flatness"), "rivals"] == "fixture bow or thermal growth"


def test_a_campaign_without_verdicts_has_an_empty_table_of_the_same_columns(verdicts):
    empty = campaign_table({"modes-only": EMPTY})
    assert empty.empty
    assert list(empty.columns) == list(campaign_table(verdicts).columns)


def test_the_stage_writes_its_files_and_the_pdf_names_what_could_not_be_told(tmp_path, verdicts):
    folders = []
    for name, verdict in verdicts.items():
        folder = tmp_path / "reports" / name
        folder.mkdir(parents=True)
        (folder / "verdict.json").write_text(json.dumps(verdict))
        (folder / "identified.json").write_text(json.dumps({"not_identified": {"force": "no runs.csv"}}))
        folders.append(folder)
        processed(tmp_path / "processed" / name)
    campaign(folders, tmp_path / "processed", tmp_path / "out", {}, "c0de")
    assert len(pd.read_parquet(tmp_path / "out" / "summary.parquet")) == 4
    page = (tmp_path / "out" / "summary.html").read_text(encoding="utf-8")
    assert 'href="../reports/modes-only/report.pdf"' in page
    document = pypdfium2.PdfDocument(tmp_path / "out" / "summary.pdf")
    text = " ".join(
        " ".join(document[i].get_textpage().get_text_range() for i in range(len(document))).split()
    )
    for words in (
        "2 batches, 4 verdicts",
        "fixture bow or thermal growth cannot be distinguished",
        "no runs.csv",
        "modes-only",
    ):
        assert words in text


def test_the_summary_is_the_same_whatever_the_order_of_the_batches(verdicts):
    backwards = dict(reversed(list(verdicts.items())))
    assert campaign_report(verdicts, {}) == campaign_report(backwards, {})


RANKED = [
    {"configuration": f"wrist {name}", "xm": synthetic.q(xm, 0.1 * xm, "um"), "probability_best": p}
    for name, xm, p in (
        ("A", 60.0, 0.9),
        ("B", 75.0, 0.1),
        ("C", 80.0, 0.0),
        ("D", 90.0, 0.0),
        ("E", 200.0, 0.0),
    )
]


def test_the_flattest_configurations_and_the_least_flat_are_ranked():
    (section,) = rankings({"faces": {"study": {"ranking": RANKED}}, "force-only": {}})
    rows = section.items[0].rows
    assert [row[1:3] for row in rows] == [
        ["1 of 5", "wrist A"], ["2 of 5", "wrist B"], ["3 of 5", "wrist C"], ["5 of 5", "wrist E"],
    ]  # fmt: skip
    assert rows[0][3:] == ["60.0 ± 6.0 µm", "0.900"]
    assert rankings({"force-only": {}}) == []


def test_the_largest_residuals_come_first_in_units_of_the_noise():
    small, large = synthetic.observable(after=2.0), synthetic.observable(after=8.0, noise_floor=2.0)
    (section,) = largest_residuals([("b1", "force", small), ("b2", "force", large), ("b3", "lobes", {})])
    told, table = section.items
    assert "2 of 2" in told.text
    assert [(row[0], row[2], row[4]) for row in table.rows] == [
        ("b2", "8.00 N", "4.0"),
        ("b1", "2.00 N", "1.1"),
    ]
    assert largest_residuals([("b3", "lobes", {})]) == []


def test_the_name_of_a_batch_leads_to_its_report(verdicts):
    pdf = campaign_report(verdicts, {}, links={"synthetic": "synthetic/report.pdf"})
    with pikepdf.open(io.BytesIO(pdf)) as document:
        notes = [note for page in document.pages for note in page.get("/Annots", [])]
        assert {str(note.A.URI) for note in notes} == {"synthetic/report.pdf"}


@pytest.mark.parametrize(
    ("runs", "expected"),
    [
        ({"started_at": ["2024-05-01T10:00:00+02:00", "", "2024-05-01T07:30:00Z"]}, "2024-05-01T07:30:00Z"),
        ({"started_at": ["", ""]}, None),
        ({"feed": [1.0]}, None),
    ],
)
def test_a_batch_starts_with_the_first_of_its_runs_that_tells_when(runs, expected):
    batch = Batch("b", {}, {}, pd.DataFrame(runs), {})
    assert batch.started == (None if expected is None else pd.Timestamp(expected).timestamp())
