"""Surface texture in the report: which waves a profile holds."""

from dataclasses import replace

import pandas as pd
import pytest
import synthetic_results as synthetic

from metro.report.content import Table
from metro.report.sections.texture import texture

NOTE = "P is the trace as recorded. λc = {} mm; Half a λc is left out at either end."


def captions(*nesting):
    """Return the captions of the tables of the profiles of traces that were parted at these lengths."""
    rows = [
        {"run": f"r{i}", "profile": letter, "parameter": f"{letter}a", "value": 1.0, "low": 0.9, "high": 1.1,
         "unit": "um", "source": "noise of the points", "notes": NOTE.format(length)}
        for i, length in enumerate(nesting)
        for letter in "PWR"
    ]  # fmt: skip
    section = texture(replace(synthetic.results(), tables={"profile_parameters": pd.DataFrame(rows)}))
    return [item.caption for item in section.items if isinstance(item, Table)]


def test_each_profile_names_the_waves_that_it_holds():
    """Two values of Wa, of different bands, had one name."""
    primary, waviness, roughness = captions(0.8, 0.8)
    assert "λc" not in primary
    assert waviness.startswith("Waviness, all waves longer than λc = 0.8 mm, parameters by ISO 21920-2")
    assert roughness.startswith("Roughness, waves shorter than λc = 0.8 mm, parameters by ISO 21920-2")


@pytest.mark.parametrize("place", [1, 2])
def test_traces_that_were_parted_at_different_lengths_have_no_band_in_common(place):
    assert "longer than" not in captions(0.8, 2.5)[place]
    assert "shorter than" not in captions(0.8, 2.5)[place]


def test_of_many_runs_the_stated_parameters_come_first_and_none_is_left_out():
    """All ten in one table took three lines a row."""
    names = ["Pa", "Pq", "Psk", "Pku", "Pp", "Pv", "Pz", "Pt", "Pdq", "PSm"]
    rows = [
        {"run": f"r{i}", "profile": "P", "parameter": name, "value": 1.0 + i + k / 16, "low": float("nan"),
         "high": float("nan"), "unit": "um" if name not in ("Psk", "Pku", "Pdq") else "1", "source": "",
         "notes": ""}
        for i in range(5)
        for k, name in enumerate(names)
    ]  # fmt: skip
    section = texture(replace(synthetic.results(), tables={"profile_parameters": pd.DataFrame(rows)}))
    stated, others = (item for item in section.items if isinstance(item, Table))
    assert stated.header == ["run", "Pa (µm)", "Pq (µm)", "Pz (µm)", "Pt (µm)", "PSm (µm)"]
    assert others.header == ["run", "Psk", "Pku", "Pp (µm)", "Pv (µm)", "Pdq"]
    assert stated.rows[2] == ["r2", "3.000", "3.062", "3.375", "3.438", "3.562"]
    assert others.rows[2] == ["r2", "3.125", "3.188", "3.250", "3.312", "3.500"]
    assert len(stated.rows) == len(others.rows) == 5
