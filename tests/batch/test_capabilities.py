import pytest
import yaml
from conftest import edit

from metro.batch.capabilities import plural
from metro.batch.check import check
from metro.observables.catalogue import capabilities

DH = "[[0,90,500,250],[90,0,0,610],[-180,-90,0,70],[0,90,710,0],[0,-90,0,0],[0,0,215,0]]"
ARM = f"cell: bench\narm: {{dh: {DH}}}\n"
JOINTS = ",".join([*(f"q{i}_set_deg" for i in range(1, 7)), *(f"q{i}_deg" for i in range(1, 7))])
LOG = f"t_s,{JOINTS},{','.join(f'tau{i}_nm' for i in range(1, 7))}\n" + "".join(
    f"{i * 0.012},{','.join(['1'] * 18)}\n" for i in range(20)
)


def answers(batch):
    report = check(batch, batch, able=capabilities)
    assert report.ok == any(can.source for can in report.capabilities)
    return {can.name: can for can in report.capabilities}


@pytest.fixture
def armed(batch):
    """The batch on an arm, with robot logs and profiles."""
    (batch / "cell.yaml").write_text(ARM)
    edit(batch / "batch.yaml", "hole_diameter_mm: 16", "tool_in_flange_mm: [0, 0, 300]")
    (batch / "log.csv").write_text(LOG)
    (batch / "p.csv").write_text("x_mm,z_mm\n" + "".join(f"{i * 0.1},0.01\n" for i in range(50)))
    edit(batch / "runs.csv", ",dynamometer\n", ",dynamometer,robot_log,idle_log,profile\n")
    for i in range(1, 5):
        (batch / f"log{i}.csv").write_text(LOG)
        (batch / f"p{i}.csv").write_text((batch / "p.csv").read_text())
        edit(batch / "runs.csv", f"dyno/r{i}.csv\n", f"dyno/r{i}.csv,log{i}.csv,log.csv,p{i}.csv\n")
    return batch


def test_force_is_computed_from_the_runs_that_have_a_dynamometer(batch):
    force = answers(batch)["force"]
    assert force.source == "4 runs with a dynamometer file, 1 held out"
    assert force.missing == ()


@pytest.mark.parametrize(
    ("file", "old", "new", "missing"),
    [
        ("batch.yaml", ", helix_deg: 30", "", "tool.helix_deg in batch.yaml"),
        ("runs.csv", "6000", "", "spindle_rpm in 4 of 4 of these runs"),
        ("runs.csv", "dyno/r", "", "dynamometer files in runs.csv"),
    ],
)
def test_what_force_lacks_is_named_with_its_key(batch, file, old, new, missing):
    if new == "" and old == "dyno/r":
        edit(batch / file, ",dynamometer\n", ",pose\n")
    edit(batch / file, old, new)
    force = answers(batch)["force"]
    assert force.source == ""
    assert missing in force.missing


def test_with_two_conditions_force_can_be_had_but_not_validated(batch):
    text = (batch / "runs.csv").read_text().splitlines()[:3]
    (batch / "runs.csv").write_text("\n".join(text))
    force = answers(batch)["force"]
    assert force.source == "2 runs with a dynamometer file, 0 held out"
    assert "a run that is held out (at least 3 conditions)" in force.missing


def test_the_force_in_the_joints_needs_an_arm_and_both_logs(batch, armed):
    assert answers(armed)["joint force"].source == "4 runs with robot_log and idle_log, 1 held out"
    edit(armed / "batch.yaml", "tool_in_flange_mm: [0, 0, 300]", "title: none")
    assert answers(armed)["joint force"].missing == ("tool_in_flange_mm in batch.yaml",)


def test_deformation_needs_the_stiffness_of_the_joints(armed):
    assert answers(armed)["deformation"].missing == ("loads.csv, or joint_stiffness_nm_rad in cell.yaml",)
    (armed / "cell.yaml").write_text(ARM + "joint_stiffness_nm_rad: [1e6, 1e6, 1e6, 1e6, 1e6, 1e6]\n")
    assert answers(armed)["deformation"].source == "4 runs with a profile, 1 held out"
    assert answers(armed)["waviness"].source == "4 runs with a profile, 1 held out"


def test_lobes_need_modes_and_coefficients(batch):
    assert answers(batch)["lobes"].missing == ("impacts.csv: the modes",)
    (batch / "frf.csv").write_text("frequency_hz,real,imag\n" + "".join(f"{i},1,0\n" for i in range(20)))
    header = "test,position,reference,response,kind,file,response_unit\n"
    (batch / "impacts.csv").write_text(header + "t,1,1x,1x,frf,frf.csv,m\n")
    assert answers(batch)["modes"].source == "0 hammer records, 1 FRF"
    assert answers(batch)["lobes"].source == "modes and coefficients; 4 runs to compare with"


def test_flatness_without_loads_and_path_is_indices_alone(batch):
    edit(batch / "runs.csv", ",dynamometer\n", ",dynamometer,scan\n")
    points = "\n".join(f"{i % 5} {i // 5} 0.01" for i in range(40))
    (batch / "face.xyz").write_text(points)
    edit(batch / "runs.csv", "dyno/r4.csv\n", "dyno/r4.csv,face.xyz\n")
    flatness = answers(batch)["flatness"]
    assert flatness.source == "1 run with a scan, 0 held out (indices alone)"
    assert "path in every run that has a scan" in flatness.missing


def test_printed_values_are_counted(batch):
    (batch / "published.csv").write_text(
        "table,row,quantity,unit,measured,predicted\n7,1,Xm,um,3,4\n7,2,Xm,um,3,\n"
    )
    assert answers(batch)["printed values"].source == "2 rows of published.csv, 1 of them pairs"


def test_a_run_whose_settings_are_blank_is_not_counted_and_the_others_are(batch):
    edit(batch / "runs.csv", "r2,slot,6000", "r2,slot,")
    force = answers(batch)["force"]
    assert force.source.startswith("3 runs with a dynamometer file")
    assert "spindle_rpm in 1 of 4 of these runs" in force.missing


def faulty(content, path=()):
    """Every document that differs from one in the type of a single value, with the place of the value."""
    for key, value in content.items():
        for other in ("four", [4], {"a": "b"}, 4, None, True):
            if type(other) is not type(value):
                yield (*path, key), {**content, key: other}
        if isinstance(value, dict):
            for place, inner in faulty(value, (*path, key)):
                yield place, {**content, key: inner}


@pytest.mark.parametrize("name", ["batch.yaml", "cell.yaml"])
def test_a_value_of_a_wrong_type_is_named_or_missing_and_stops_no_check(armed, name):
    edit(armed / "batch.yaml", "tool_in_flange_mm", "hole_diameter_mm: 16\ntool_in_flange_mm")
    orbit = (armed / "runs.csv").read_text().replace(",slot,6000", ",helical,6000").replace("\nr", "\n90,r")
    (armed / "runs.csv").write_text(f"orbit_rpm,{orbit}")
    content = yaml.safe_load((armed / name).read_text())
    assert check(armed, armed, able=capabilities).ok
    refused = 0
    for place, wrong in faulty(content):
        (armed / name).write_text(yaml.safe_dump(wrong))
        report = check(armed, armed, able=capabilities)
        named = any(place[0] in finding.column.split(".") for finding in report.problems)
        refused += named and not report.ok
    assert refused > len(content)


def test_what_an_entry_that_is_refused_is_needed_for_cannot_be_computed(batch):
    edit(batch / "batch.yaml", "teeth: 4", "teeth: four")
    can = {each.name: each for each in check(batch, batch, able=capabilities).capabilities}
    assert can["force"].source == ""
    assert can["force"].missing == ("tool.teeth in batch.yaml",)


def test_what_is_counted_is_singular_once():
    assert [plural(n, "batch") for n in (0, 1, 2)] == ["0 batches", "1 batch", "2 batches"]
    assert [plural(n, "run") for n in (1, 3)] == ["1 run", "3 runs"]
