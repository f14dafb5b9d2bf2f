import pytest
from conftest import edit

from metro.batch.check import check


def faults(batch):
    return [str(finding) for finding in check(batch, batch).problems if finding.severity == "error"]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("dyno/none.csv", '"dyno/none.csv" is not there'),
        ("../trial/dyno/r1.csv", "leads outside the batch"),
        ("/etc/hostname", "leads outside the batch"),
        ("dyno\\r1.csv", "is written with backslashes"),
        ("dyno", "is a folder, expected a file"),
        ("dyno/empty.csv", "is empty, expected data"),
        ("dyno/link.csv", "is a link that leads outside the batch"),
        ("dyno/text.csv", "cannot be read"),
    ],
)
def test_a_file_that_cannot_be_used_is_named_with_its_row(batch, name, message):
    (batch / "dyno/empty.csv").write_text("")
    (batch / "dyno/text.csv").write_text("hello\nworld\n")
    (batch.parent / "outside.csv").write_text((batch / "dyno/r1.csv").read_text())
    (batch / "dyno/link.csv").symlink_to(batch.parent / "outside.csv")
    edit(batch / "runs.csv", "dyno/r3.csv", name)
    (fault,) = faults(batch)
    assert "runs.csv: row 4 (r3): column dynamometer:" in fault
    assert message in fault


def test_a_link_inside_the_batch_is_a_file_of_the_batch(batch):
    (batch / "dyno/again.csv").symlink_to(batch / "dyno/r3.csv")
    edit(batch / "runs.csv", "dyno/r3.csv", "dyno/again.csv")
    assert faults(batch) == []


def test_a_recording_that_two_runs_name_is_a_warning(batch):
    edit(batch / "runs.csv", "dyno/r3.csv", "dyno/r2.csv")
    (warning,) = [finding for finding in check(batch, batch).problems if finding.severity == "warning"]
    assert '"dyno/r2.csv" is named by run r2 too' in warning.message


def test_the_files_of_hammer_tests_are_opened_by_their_kind(batch):
    header = "test,position,reference,response,kind,file,response_unit\n"
    (batch / "frf.csv").write_text("frequency_hz,real,imag\n" + "".join(f"{i},1,0\n" for i in range(20)))
    (batch / "impacts.csv").write_text(header + "t,1,1x,1x,frf,frf.csv,m\n")
    assert faults(batch) == []
    (batch / "impacts.csv").write_text(header + "t,1,1x,1x,record,frf.csv,m\n")
    (fault,) = faults(batch)
    assert 'impacts.csv: row 2 (t): column file: "frf.csv" cannot be read' in fault
