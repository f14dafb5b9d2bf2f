"""Nothing outside a batch's folder is opened, whatever its files say."""

import os

import corpus_batches as batches
import pytest

from metro.batch.check import check
from metro.batch.discover import discover
from metro.batch.findings import errors

SECRET = "root:x:0:0:swordfish"


@pytest.fixture
def batch(tmp_path):
    folder = tmp_path / "raw" / "specimen"
    batches.write(folder, "dynamometer")
    (tmp_path / "secret.csv").write_text(f"{SECRET}\n1,2\n")
    return folder


def told(batch):
    report = check(batch, batch.parents[1] / "cells")
    text = "\n".join(str(problem) for problem in errors(report.problems))
    assert text
    assert "swordfish" not in text
    return text


@pytest.mark.parametrize(
    "name", ["../../secret.csv", "dynamometer/../../../secret.csv", "{absolute}", "out/secret.csv"]
)
def test_a_recording_outside_the_batch_is_refused_and_not_shown(batch, name):
    (batch / "out").symlink_to(batch.parents[1])
    path = batch / "runs.csv"
    name = name.format(absolute=batch.parents[1] / "secret.csv")
    path.write_text(path.read_text().replace("dynamometer/r2.csv", name))
    assert "outside the batch" in told(batch)


@pytest.mark.parametrize("file", ["batch.yaml", "cell.yaml", "runs.csv", "loads.csv", "mass.parquet"])
def test_a_description_that_is_a_link_to_elsewhere_is_refused_and_not_shown(batch, file):
    (batch / file).unlink(missing_ok=True)
    (batch / file).symlink_to(batch.parents[1] / "secret.csv")
    assert f"{file}: is a link that leads outside" in told(batch)


@pytest.mark.parametrize("stations", ["../../secret.csv", "{absolute}", "out/secret.csv"])
def test_stations_outside_the_batch_are_refused_and_not_shown(batch, stations):
    (batch / "out").symlink_to(batch.parents[1])
    stations = stations.format(absolute=batch.parents[1] / "secret.csv")
    (batch / "cell.yaml").write_text(batches.CELL + f"stations: {stations}\n")
    assert "stations" in told(batch)


@pytest.mark.parametrize("cell", ["../secret", "../../secret", "{absolute}"])
def test_a_cell_is_not_looked_for_outside_the_folder_of_cells(batch, cell):
    top = batch.parents[1]
    for place in (top, top.parent):
        (place / "secret.yaml").write_text(f"cell: {SECRET}\n")
    (batch / "cell.yaml").unlink()
    text = batches.MANIFEST.replace("bench-arm", cell.format(absolute=top / "secret"))
    (batch / "batch.yaml").write_text(text)
    (top / "cells").mkdir()
    (found,) = discover([batch.parent], top / "cells")
    assert found.cell_file is None
    assert "cell" in told(batch)


def test_shared_stations_are_not_looked_for_outside_the_folder_of_cells(batch):
    top = batch.parents[1]
    (top / "cells").mkdir()
    (batch / "cell.yaml").rename(top / "cells/bench-arm.yaml")
    with (top / "cells/bench-arm.yaml").open("a") as stream:
        stream.write("stations: ../secret.csv\n")
    (found,) = discover([batch.parent], top / "cells")
    assert (found.cell_file, found.stations_file) == (top / "cells/bench-arm.yaml", None)


@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_what_is_no_file_is_not_waited_for(batch, kind):
    path = batch / "dynamometer/r2.csv"
    path.unlink()
    if kind == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to("/dev/zero")
    assert "r2.csv" in told(batch)
