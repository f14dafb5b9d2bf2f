"""TDMS as another program writes it, and what that program makes of a file that is cut off."""

import numpy as np
import pytest

from metro.formats import FormatError
from metro.formats.registry import read, sniff

nptdms = pytest.importorskip("nptdms", reason="npTDMS is not installed (development only)")

TIME = np.arange(100) * 1e-3
FORCES = dict(zip(("Fx", "Fy", "Fz"), np.random.default_rng(0).normal(size=(3, 100)), strict=True))
WAVE = {"wf_increment": 1e-3, "wf_start_offset": 0.0, "wf_samples": 1}


def written(path, *others, segments=1, dtype="f8", wave=False):
    """Write three forces and the time, a channel or the waveform's, with npTDMS."""
    properties = {"unit_string": "N", **(WAVE if wave else {})}
    with nptdms.TdmsWriter(str(path)) as writer:
        for part in np.array_split(np.arange(100), segments):
            time = nptdms.ChannelObject("Cut", "Time", TIME[part], {"unit_string": "s"})
            forces = [
                nptdms.ChannelObject("Cut", name, values[part].astype(dtype), properties)
                for name, values in FORCES.items()
            ]
            writer.write_segment([nptdms.RootObject({"title": "cut 1"}), *([] if wave else [time]), *forces])
        if others:
            writer.write_segment(others)
    return path


@pytest.mark.parametrize(
    ("options", "error"), [({}, 0.0), ({"segments": 7}, 0.0), ({"wave": True}, 0.0), ({"dtype": "f4"}, 1e-6)]
)
def test_what_another_program_writes_is_read(tmp_path, options, error):
    path = written(tmp_path / "a.tdms", **options)
    sniff(path, "force")
    table = read(path, "force")
    np.testing.assert_allclose(table["t_s"], TIME, atol=1e-15)
    for name, values in FORCES.items():
        np.testing.assert_allclose(table[f"{name.lower()}_n"], values, rtol=0.0, atol=error)


def test_channels_of_text_and_of_dates_stand_beside(tmp_path):
    others = (
        nptdms.ChannelObject("Log", "note", ["begin", "end"]),
        nptdms.ChannelObject("Log", "when", np.array(["2024-05-01T10:00:00"], "datetime64[us]")),
    )
    assert len(read(written(tmp_path / "a.tdms", *others), "force")) == 100


def test_a_file_that_is_cut_off_is_refused_where_the_other_program_reads_on(tmp_path):
    path = written(tmp_path / "a.tdms")
    path.write_bytes(path.read_bytes()[:-1])
    (group,) = nptdms.TdmsFile.read(path).groups()
    assert [len(channel) for channel in group.channels()] == [100, 100, 100, 99]
    with pytest.raises(FormatError, match="ends early"):
        read(path, "force")
