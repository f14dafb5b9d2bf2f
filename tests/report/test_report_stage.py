"""The report stage: files in, one PDF out."""

import json

import pandas as pd
import pypdfium2
import synthetic_results as synthetic

from metro.batch.processed import COLUMNS, write_batch, write_table
from metro.stages.report import read_results, report


def write_results(processed, reports):
    write_batch(processed, synthetic.batch(), {"sources": json.dumps({"runs.csv": "ab" * 32})})
    for name, table in synthetic.tables().items():
        write_table(processed / f"{name}.parquet", table, {"sources": json.dumps({f"{name}.csv": "cd" * 32})})
    for name in {"stations", "robot", "hit", "force"} - set(
        synthetic.tables()
    ):  # ingest writes every table, empty or not
        write_table(processed / f"{name}.parquet", pd.DataFrame(columns=list(COLUMNS[name])), {})
    reports.mkdir()
    (reports / "identified.json").write_text(json.dumps(synthetic.identified()))
    (reports / "verdict.json").write_text(json.dumps(synthetic.verdict()))
    (processed / "loop.json").write_text(json.dumps(synthetic.told()))


def test_the_stage_writes_the_pdf_from_the_files_of_the_stages_before(tmp_path):
    write_results(tmp_path / "processed", tmp_path / "reports")
    report(tmp_path / "processed", tmp_path / "reports", {}, "c0de")
    document = pypdfium2.PdfDocument(tmp_path / "reports" / "report.pdf")
    text = " ".join(document[i].get_textpage().get_text_range() for i in range(len(document)))
    assert "A batch of every kind" in text
    assert f"runs.csv {'ab' * 6}" in text


def test_empty_and_absent_tables_are_left_out_and_sources_are_gathered(tmp_path):
    write_results(tmp_path / "processed", tmp_path / "reports")
    write_table(tmp_path / "processed" / "qc.parquet", synthetic.tables()["qc"].iloc[:0], {})
    results = read_results(tmp_path / "processed", tmp_path / "reports", {}, "")
    assert "qc" not in results.tables
    assert "published_errors" not in results.tables
    assert set(results.sources) == {
        "runs.csv",
        "comparison.csv",
        "lobes_final.csv",
        "lobe_methods.csv",
        "lobe_islands.csv",
        "face_map.csv",
        "frf_used.csv",
    }
