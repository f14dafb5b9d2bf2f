"""The lines that the page on exporting shows are lines that the readers accept."""

import re
from pathlib import Path

import pandas as pd
import pytest
import yaml

from metro.batch.check import check
from metro.formats import FormatError
from metro.formats.kinds import KINDS
from metro.formats.registry import sniff
from metro.formats.uff import FRF, read_functions

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/exporting.md").read_text(encoding="utf-8")


def samples(heading, language="text"):
    section = re.search(rf"^## {heading}\n(.*?)(?=^## |\Z)", PAGE, re.DOTALL | re.MULTILINE)[1]
    return re.findall(rf"^```{language}\n(.*?)^```$", section, re.DOTALL | re.MULTILINE)


SHOWN = {
    "Force: DynoWare": [("force", "slot.txt")],
    "Robot: KUKA RSI": [("robot", "log.rsi")],
    "Faces: PolyWorks and scanners": [("cloud", "face.xyz"), ("cloud", "face.ply")],
}


@pytest.mark.parametrize("heading", sorted(SHOWN))
def test_what_is_shown_is_read_and_what_is_shown_without_its_first_column_is_not(heading, tmp_path):
    texts = samples(heading)
    assert len(texts) == len(SHOWN[heading])
    for text, (kind, name) in zip(texts, SHOWN[heading], strict=True):
        assert text.count("\n") >= 4
        (tmp_path / name).write_text(text, encoding="utf-8")
        sniff(tmp_path / name, kind)
        (tmp_path / name).write_text(re.sub(r"(?m)^([-\d.]+)[ \t]|A1=\S+", "", text), encoding="utf-8")
        with pytest.raises(FormatError):
            sniff(tmp_path / name, kind)


def test_the_readings_that_are_shown_are_slopes_and_without_a_foot_they_are_not(tmp_path):
    (text,) = samples("Faces: levels and autocollimators", "csv")
    (tmp_path / "plate.csv").write_text(text, encoding="utf-8")
    sniff(tmp_path / "plate.csv", "slopes")
    (tmp_path / "plate.csv").write_text(text.replace("x2_mm", "x"), encoding="utf-8")
    with pytest.raises(FormatError):
        sniff(tmp_path / "plate.csv", "slopes")


@pytest.fixture
def batch(tmp_path):
    """A batch of the tables that the page shows, with the files that they name."""
    folder = tmp_path / "shown"
    (folder / "modal").mkdir(parents=True)
    manifest = {"format": 1, "batch": "shown", "source": "measured", "cell": "kr160", "instruments": {}}
    manifest |= {"tool_in_flange_mm": [212.5, 0.0, 279.91]}
    (folder / "batch.yaml").write_text(yaml.safe_dump(manifest), encoding="utf-8")
    ((uff,), (impacts, loads)) = (samples("Hammer.*?", each) for each in ("text", "csv"))
    (folder / "modal/tip.uff").write_text(uff, encoding="utf-8")
    (folder / "impacts.csv").write_text(impacts, encoding="utf-8")
    (folder / "loads.csv").write_text(loads, encoding="utf-8")
    record = pd.DataFrame({name: range(16) for name in KINDS["record"].required})
    record.to_csv(folder / "modal/tip-1.csv", index=False)
    return folder


def test_the_universal_file_that_is_shown_holds_the_response_that_the_page_says(batch):
    (frf,) = read_functions(batch / "modal/tip.uff")
    assert (frf.kind, frf.reference, frf.response, frf.unit) == (FRF, "1x", "1x", "m/s2")
    assert list(frf.frequency) == [100.0, 100.5, 101.0]
    assert list(frf.values) == [-0.05213 + 0.0112j, -0.0553 + 0.0131j, -0.0587 + 0.0155j]


def test_the_tables_that_are_shown_have_no_error(batch):
    report = check(batch)
    assert [str(one) for one in report.problems if one.severity == "error"] == []
    assert {"impacts.csv", "loads.csv"} <= set(re.findall(r"\w+\.csv", " ".join(report.there)))
