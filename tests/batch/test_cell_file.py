from pathlib import Path

import pytest

from metro.batch.arm import effects_agree
from metro.batch.cell import cells_findings, read_cell, shared_cells, stations_path

CELLS = Path(__file__).parents[2] / "config/cells"


def faults(folder):
    return "\n".join(
        str(finding) for finding in read_cell(folder, folder, "kr160")[2] if finding.severity == "error"
    )


@pytest.mark.parametrize("name", sorted(path.stem for path in CELLS.glob("*.yaml")))
def test_every_cell_of_the_repository_is_valid(tmp_path, name):
    cell, source, findings = read_cell(tmp_path, CELLS, name)
    assert (cell["cell"], source, findings) == (name, CELLS / f"{name}.yaml", [])


def test_a_cell_that_nobody_describes_is_rigid_and_said_to_be(tmp_path):
    cell, source, findings = read_cell(tmp_path, tmp_path, "kr160")
    assert (cell, source) == ({"cell": "kr160"}, None)
    assert findings[0].severity == "note"
    assert "nothing is known of cell kr160 (rigid)" in findings[0].message


@pytest.mark.parametrize("name", ["kr-160", "KR160", "kr16"])
def test_the_known_cell_that_a_name_is_a_slip_of_is_named_in_a_warning(tmp_path, name):
    (finding,) = read_cell(tmp_path, CELLS, name)[2]
    assert finding.severity == "warning"
    assert finding.message.endswith('(did you mean "kr160"?)')


def test_a_folder_without_cells_of_its_own_has_those_of_the_checkout(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    _, source, findings = read_cell(tmp_path, Path("config/cells"), "kr160")
    assert (source, findings) == (CELLS / "kr160.yaml", [])
    (tmp_path / "config/cells").mkdir(parents=True)
    assert read_cell(tmp_path, Path("config/cells"), "kr160")[1] is None


def test_a_folder_of_cells_that_was_asked_for_must_be_there(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for cells in (Path("nope"), tmp_path / "nope"):
        (finding,) = cells_findings(shared_cells(cells))
        assert str(finding) == f"{cells}: is not a folder, expected that of the shared cells"
    nobodys = shared_cells(Path("config/cells"), tmp_path)
    assert (nobodys, cells_findings(nobodys)) == (Path("config/cells"), [])


def test_the_batch_s_own_cell_goes_before_the_shared_one(tmp_path):
    (tmp_path / "cells").mkdir()
    (tmp_path / "cells/kr160.yaml").write_text("cell: kr160\nstations: shared.csv\n")
    (tmp_path / "cell.yaml").write_text("cell: kr160\nstations: own.csv\n")
    cell, source, _ = read_cell(tmp_path, tmp_path / "cells", "kr160")
    assert stations_path(cell, source) == tmp_path / "own.csv"
    cell, source, _ = read_cell(tmp_path / "cells", tmp_path / "cells", "kr160")
    assert stations_path(cell, source) == tmp_path / "cells/shared.csv"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("cell: other", 'cell: found "other", expected the cell that batch.yaml names, "kr160"'),
        ("stations: a.csv", "cell: is missing"),
        (
            "cell: kr160\narm: {dh: [[0, 90, 500]]}",
            "arm.dh.0: found [0, 90, 500], expected a list of 4 numbers",
        ),
        ("cell: kr160\narm: {dh: [[0, 90, 500, 250]]}", "expected a list of 2 to 16 lists of 4 numbers"),
        (
            "cell: kr160\njoint_stiffness_nm_rad: [1, 2, 3, 4, 5, 0]",
            "joint_stiffness_nm_rad.5: found 0, expected 1 to 1e10 Nm/rad",
        ),
        ("cell: kr160\njoint_stifness_nm_rad: [1]", 'did you mean "joint_stiffness_nm_rad"?'),
        ("cell: [", "cell.yaml: line 1:"),
    ],
)
def test_an_error_is_said_with_its_key(tmp_path, text, message):
    (tmp_path / "cell.yaml").write_text(text)
    assert message in faults(tmp_path)


def test_joint_stiffness_without_an_arm_is_of_no_use(tmp_path):
    (tmp_path / "cell.yaml").write_text(
        "cell: kr160\njoint_stiffness_nm_rad: [1, 2, 3, 4, 5, 6]\nmaker: unknown"
    )
    findings = read_cell(tmp_path, tmp_path, "kr160")[2]
    assert [(finding.severity, finding.column) for finding in findings] == [
        ("warning", "maker"),
        ("warning", "joint_stiffness_nm_rad"),
    ]


BODY = "{mass_kg: 10, centre_mm: [0, 0, 0]%s}"
DH = "[[0,90,500,250],[90,0,0,610],[-180,-90,0,70],[0,90,710,0],[0,-90,0,0],[0,0,215,0]]"
ARM = f"cell: kr160\narm:\n  dh: {DH}\n"


def test_links_and_head_of_an_arm_are_read(tmp_path):
    links = ", ".join([BODY % ""] * 6)
    head = BODY % ", inertia_kg_m2: [1, 2, 1.5, 0, 0, 0]"
    (tmp_path / "cell.yaml").write_text(ARM + f"  links: [{links}]\n  head: {head}\n")
    assert faults(tmp_path) == ""


def test_moments_of_inertia_that_no_body_has_are_an_error(tmp_path):
    """Those of [F] table 4: 3.122 exceeds 0.934 + 1.433."""
    links = ", ".join([BODY % ""] * 6)
    head = BODY % ", inertia_kg_m2: [0.934, 3.122, 1.433, 0, 0, 0]"
    (tmp_path / "cell.yaml").write_text(ARM + f"  links: [{links}]\n  head: {head}\n")
    assert "arm.head.inertia_kg_m2: found principal moments of 0.934, 1.433, 3.122" in faults(tmp_path)


def test_links_must_be_six_with_a_mass_each(tmp_path):
    (tmp_path / "cell.yaml").write_text(ARM + "  links: [{mass_kg: 10}]\n")
    assert "arm.links" in faults(tmp_path)


@pytest.mark.parametrize(("joint", "fault"), [(6, ""), (7, "found 7, expected a joint, 1 to 6"), ("all", "")])
def test_an_effect_is_declared_of_a_joint_that_the_arm_has(joint, fault):
    cell = {"arm": {"dh": [[0, 0, 0, 0]] * 6}}
    known = {"friction_reversal": {"joint": joint, "torque_nm": 5.0}, "tool_runout": {"radius_um": 3.0}}
    found = [*effects_agree(cell, known, "batch.yaml")]
    assert [one.column for one in found] == (["known.friction_reversal.joint"] if fault else [])
    assert all(fault in one.message for one in found)
    assert not [*effects_agree({"cell": "mill"}, known, "batch.yaml")]
