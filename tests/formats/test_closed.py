"""Files of programs whose formats nobody describes: named, with what to export instead."""

import pytest

from metro.formats import FormatError
from metro.formats.registry import open_contents, read, sniff
from metro.formats.text_layout import TextOptions
from metro.importing.look import look


@pytest.mark.parametrize("content", [b"EDX-2000A\r\n01.00\r\n" * 40, b"EDX\0\x01\x02" * 100])
@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("slot.ks2", "DCS-100A or PCD, whose format is not published: export it as CSV"),
        ("slot.KS1", "export it as CSV from that program"),
        ("slot.dwd", "export it as text from DynoWare"),
    ],
)
def test_a_closed_file_is_refused_with_what_to_export(tmp_path, name, says, content):
    path = tmp_path / name
    path.write_bytes(content)
    for reads in (
        lambda: read(path, "force"),
        lambda: sniff(path, "record"),
        lambda: open_contents(path, "force", TextOptions()),
    ):
        with pytest.raises(FormatError, match=says):
            reads()
    assert says in look(path).fault


def test_a_text_that_states_its_own_format_is_read_whatever_it_is_called(tmp_path):
    rows = "".join(f"{k * 1e-4:.6f}\t{k}\t{2 * k}\t{3 * k}\n" for k in range(20))
    path = tmp_path / "slot.dwd"
    path.write_text(f"DynoWare\nTime\tFx\tFy\tFz\ns\tN\tN\tN\n{rows}")
    assert list(read(path, "force")["fy_n"]) == [2.0 * k for k in range(20)]
