import re

import pytest
import yaml
from conftest import edit

from metro.batch.axes import signed_axes
from metro.batch.findings import errors
from metro.batch.manifest import read_manifest, with_defaults

IDENTITY = "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"


def faults(batch, severity="error"):
    return [str(finding) for finding in read_manifest(batch)[1] if finding.severity == severity]


def test_a_manifest_that_follows_the_contract_has_no_findings(batch):
    assert read_manifest(batch)[1] == []


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("teeth: 4", "teeth: four", 'batch.yaml: tool.teeth: found "four", expected an integer, 1 to 120'),
        ("teeth: 4", "teeth: 0", "tool.teeth: found 0, expected 1 to 120: from single"),
        (
            "diameter_mm: 10",
            "diameter_mm: -1",
            "tool.diameter_mm: found -1, expected 0.02 to 2000 mm: from the finest",
        ),
        (
            "diameter_mm: 10",
            "diameter: 10",
            'tool.diameter: is not a known key (did you mean "diameter_mm"?)',
        ),
        ("helix_deg: 30", "helix_deg: 90", "tool.helix_deg: found 90, expected 0 to 80 deg"),
        ("format: 1", "format: 2", "format: found 2, expected 1"),
        ("format: 1\n", "", "format: is missing, expected 1"),
        (
            "source: measured",
            "source: guessed",
            'source: found "guessed", expected "measured" or "simulated"',
        ),
        ("cell: bench", "cell: ../bench", 'cell: found "../bench", expected a name of letters'),
        ("cell: bench\n", "", "cell: is missing"),
        ("batch: trial", "batch: other", 'batch: found "other", expected the folder\'s name, "trial"'),
        ("batch: trial", "batch: Trial", 'batch: found "Trial", expected the folder\'s name: lower-case'),
        ("batch: trial", "batch: 17", "batch: found 17, expected the folder's name"),
        (
            "teeth: 4",
            "teeth: 4, pitch_deg: [90, 90, 90]",
            "tool: pitch_deg has 3 angles, expected as many as teeth (4)",
        ),
        (
            "teeth: 4",
            "pitch_deg: [90, 90, 90, 90]",
            "tool: pitch_deg has 4 angles, but teeth is missing, expected teeth: 4",
        ),
        ("teeth: 4", "teeth: 4, pitch_deg: [90, 90, 90, 80]", "tool: pitch_deg adds up to 350, expected 360"),
        ("teeth: 4", "teeth: 4, end: round", 'tool.end: found "round", expected "flat" or "ball"'),
        ("teeth: 4", "teeth: 4, corner_radius_mm: 6", "corner_radius_mm is 6, expected at most half of"),
        ("teeth: 4", "teeth: 4, end: ball, corner_radius_mm: 2", "expected none with end: ball"),
        ("teeth: 4", "teeth: 4, end: flat, corner_radius_mm: 2", "a tool with a corner is not flat"),
        ("diameter_mm: 10,", "corner_radius_mm: 2,", "is given without diameter_mm, expected both"),
        ("diameter_mm: 10,", "corner_radius_mm: two,", 'tool.corner_radius_mm: found "two", expected'),
        (
            "teeth: 4",
            "teeth: 4, taper_deg: 10, cutting_edge_angle_deg: 70",
            "taper_deg is 10 and cutting_edge_angle_deg 70, expected one of them",
        ),
        ("rate_hz: 1000", "axes: {x: y}", 'axes: found {"x": "y"}, which names one direction twice'),
        ("rate_hz: 1000", "axes: {x: -x}", 'axes: found {"x": "-x"}, which is left-handed'),
        ("rate_hz: 1000", "axes: {x: y, y: x}", "which is left-handed, expected each of x, y, z once"),
        ("rate_hz: 1000", "axes: {x: up}", 'instruments.dynamometer.axes.x: found "up", expected "x" or "y"'),
        ("rate_hz: 1000", "reads: sensor", 'reads: found "sensor", expected "work" or "tool"'),
        ("hole_diameter_mm: 16", "hole_diameter_mm: .inf", 'line 6: found ".inf", expected a finite number'),
        ("hole_diameter_mm: 16", "tool_in_flange_mm: [1, 2]", "found [1, 2], expected a list of 3 numbers"),
        (
            "hole_diameter_mm: 16",
            "tool_axes_in_flange: [[1,0,0],[0,1,0],[0,0,-1]]",
            "it is left-handed (a mirror)",
        ),
        (
            "hole_diameter_mm: 16",
            "tool_axes_in_flange: [[0.5,0,0],[0,1,0],[0,0,1]]",
            "not perpendicular unit vectors",
        ),
        (
            "hole_diameter_mm: 16",
            "tool_axes_in_flange: [[1,0],[0,1]]",
            "expected a list of 3 lists of 3 numbers",
        ),
        (
            "hole_diameter_mm: 16",
            "work: {size_mm: [10, 10, 0]}",
            "work.size_mm.2: found 0, expected 0.001 to 100000 mm",
        ),
        (
            "hole_diameter_mm: 16",
            "coefficients: {ktc: 3}",
            'coefficients.ktc: is not a known key (did you mean "ktc',
        ),
        (
            "hole_diameter_mm: 16",
            "known: {tool_runot: {}}",
            'known.tool_runot: is not a known key (did you mean "tool_run',
        ),
        ("hole_diameter_mm: 16", "cell: bench", 'line 6: key "cell" appears twice'),
        ("hole_diameter_mm: 16", "hole_diameter_mm: [16", "line 7:"),
        ("hole_diameter_mm: 16", "\thole_diameter_mm: 16", "line 6:"),
    ],
)
def test_an_error_is_said_with_key_what_was_found_and_what_was_expected(batch, old, new, message):
    edit(batch / "batch.yaml", old, new)
    assert message in "\n".join(faults(batch))


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (IDENTITY.replace("[1,0", "[2,0"), "not perpendicular unit vectors"),
        (IDENTITY.replace("[1,0", "[-1,0"), "left-handed"),
        (IDENTITY.replace("0,1]", "1,1]"), "its last row is not 0 0 0 1"),
        ("[[1,0,0],[0,1,0],[0,0,1]]", "expected a list of 4 lists of 4 numbers"),
    ],
)
def test_a_scanner_pose_that_is_no_rigid_motion_is_an_error(batch, matrix, message):
    edit(batch / "batch.yaml", "  dynamometer:", f"  scanner: {{to_work: {matrix}}}\n  dynamometer:")
    assert message in "\n".join(faults(batch))


def test_a_scanner_pose_printed_to_five_digits_is_a_rigid_motion(batch):
    matrix = "[[0.86603,-0.5,0,12],[0.5,0.86603,0,3],[0,0,1,-4],[0,0,0,1]]"
    edit(batch / "batch.yaml", "  dynamometer:", f"  scanner: {{to_work: {matrix}}}\n  dynamometer:")
    assert faults(batch) == []


@pytest.mark.parametrize(
    ("old", "new", "column"),
    [
        ("cell: bench", "cell: bench\noperator: somebody", "operator"),
        ("cell: bench", "cell: bench\nhole: a", "hole"),
        ("rate_hz: 1000", "rate_hz: 1000, model: 9257B", "instruments.dynamometer.model"),
        ("rate_hz: 1000", "rate_hz: 1000, noise_x_n: 2", "instruments.dynamometer.noise_x_n"),
        ("rate_hz: 1000", "rate_hz: 1000, rate_khz: 1", "instruments.dynamometer.rate_khz"),
        ("  dynamometer:", "  robot: {maker: a}\n  dynamometer:", "instruments.robot"),
        ("  dynamometer:", "  microphone: {rate_hz: 5}\n  dynamometer:", "instruments.microphone"),
        ("teeth: 4", "teeth: 4, coating: none", "tool.coating"),
        ("cell: bench", "cell: bench\nknown: {helix_error: {angle_deg: 1}}", "known.helix_error"),
    ],
)
def test_a_field_that_may_have_been_added_is_a_warning(batch, old, new, column):
    edit(batch / "batch.yaml", old, new)
    findings = read_manifest(batch)[1]
    assert [(finding.severity, finding.column) for finding in findings] == [("warning", column)]


@pytest.mark.parametrize(
    ("old", "new", "column", "near"),
    [
        ("cell: bench", "cell: bench\ntittle: a", "tittle", "title"),
        ("instruments:", "instrumnets:", "instrumnets", "instruments"),
        ("  dynamometer:", "  dynamometr:", "instruments.dynamometr", "dynamometer"),
        ("rate_hz: 1000", "axis: {x: -x, y: y, z: -z}", "instruments.dynamometer.axis", "axes"),
        ("rate_hz: 1000", "rate_hz: 1000, range: 5", "instruments.dynamometer.range", "range_n"),
        ("rate_hz: 1000", "Reads: tool", "instruments.dynamometer.Reads", "reads"),
    ],
)
def test_a_slip_of_the_pen_for_a_key_that_is_absent_is_an_error(batch, old, new, column, near):
    edit(batch / "batch.yaml", old, new)
    assert faults(batch) == [f'batch.yaml: {column}: is not a known key (did you mean "{near}"?)']


@pytest.mark.parametrize(
    ("written", "hint"),
    [
        ("12,5", "write 12.5"),
        ("12, 5", "write 12.5"),
        ("8,192", "write 8192 or 8.192"),
        ("1,000,000", "write 1000000"),
    ],
)
def test_a_comma_in_a_number_is_an_error_that_says_how_to_write_it(batch, written, hint):
    edit(batch / "batch.yaml", "rate_hz: 1000", f"rate_hz: {written}, range_n: 5,000")
    found = [fault.split(": expected")[0] for fault in faults(batch)]
    assert found[0].startswith("batch.yaml: instruments.dynamometer.rate_hz: found ")
    assert found[0].endswith(f"expected a number, 0.01 to 1e8 Hz: {hint}")
    assert found[1].endswith('range_n: found "5,000", expected a number, 0.001 to 1e7 N: write 5000 or 5.000')


def test_a_comma_that_parts_two_keys_is_left_alone(batch):
    edit(batch / "batch.yaml", "rate_hz: 1000", "rate_hz: 1000, 5: 3")
    assert [finding.column for finding in read_manifest(batch)[1]] == ["instruments.dynamometer.5"]


@pytest.mark.parametrize(
    ("limits", "severity", "message"),
    [
        (
            "{axial: [1, 2]}",
            "error",
            "limits.axial: is no column of runs.csv that can be limited (did you mean",
        ),
        (
            "{axial_depth_mm: [2, 1]}",
            "error",
            "limits.axial_depth_mm: found [2, 1], expected the least first",
        ),
        ("{power_kw: [0, 5]}", "warning", "limits.power_kw: is no column of runs.csv"),
    ],
)
def test_limits_are_of_columns_and_begin_with_the_least(batch, limits, severity, message):
    edit(batch / "batch.yaml", "cell: bench", f"cell: bench\nlimits: {limits}")
    (finding,) = read_manifest(batch)[1]
    assert finding.severity == severity
    assert message in str(finding)


def test_a_published_batch_needs_a_citation_and_its_values(batch):
    edit(batch / "batch.yaml", "source: measured", "source: published")
    assert [fault.split(":")[0] for fault in faults(batch)] == ["batch.yaml", "published.csv"]
    (batch / "published.csv").write_text("x")
    edit(batch / "batch.yaml", "cell: bench", "cell: bench\ncitation: a book")
    assert faults(batch) == []


def test_all_errors_are_found_at_once(batch):
    edit(batch / "batch.yaml", "teeth: 4", "teeth: four")
    edit(batch / "batch.yaml", "batch: trial", "batch: other")
    edit(batch / "batch.yaml", "rate_hz: 1000", "axes: {x: -x}")
    assert len(faults(batch)) == 3


def test_a_file_that_is_not_utf8_or_no_mapping_is_said(batch):
    (batch / "batch.yaml").write_bytes("title: Ø\n".encode("latin-1"))
    assert "is not UTF-8 text (byte 8)" in faults(batch)[0]
    (batch / "batch.yaml").write_text("- a\n- b\n")
    assert "expected keys with values" in faults(batch)[0]


def test_numbers_and_dates_are_read_as_people_write_them(batch):
    edit(batch / "batch.yaml", "hole_diameter_mm: 16", "hole_diameter_mm: 1.6e1\ntitle: 2024-05-01")
    edit(batch / "batch.yaml", "rate_hz: 1000", "rate_hz: 1e3")
    manifest, findings = read_manifest(batch)
    assert findings == []
    assert (manifest["hole_diameter_mm"], manifest["title"]) == (16.0, "2024-05-01")
    assert manifest["instruments"]["dynamometer"]["rate_hz"] == 1000.0


def test_defaults_are_those_of_the_contract(batch):
    filled = with_defaults(read_manifest(batch)[0])
    assert filled["tool"]["pitch_deg"] == [90, 90, 90, 90]
    assert filled["known"] == {}
    assert filled["work_in_base"] == {"xyz_mm": [0, 0, 0], "rpy_deg": [0, 0, 0]}
    assert filled["instruments"]["dynamometer"] == {
        "reads": "work",
        "rotation_deg": 0,
        "rate_hz": 1000,
        "axes": {"x": "x", "y": "y", "z": "z"},
    }


def test_what_is_declared_stands_against_the_defaults(batch):
    edit(batch / "batch.yaml", "rate_hz: 1000", "reads: tool, axes: {x: -y, y: -x, z: -z}, rotation_deg: 3")
    entry = with_defaults(read_manifest(batch)[0])["instruments"]["dynamometer"]
    assert entry == {"reads": "tool", "rotation_deg": 3, "axes": {"x": "-y", "y": "-x", "z": "-z"}}


def test_the_columns_of_the_axes_are_the_directions_of_the_sensor():
    columns = signed_axes({"x": "-y", "y": "-x", "z": "-z"})
    assert (columns @ [1, 0, 0]).tolist() == [0, -1, 0]
    assert (columns @ [0, 1, 0]).tolist() == [-1, 0, 0]
    assert (columns @ [0, 0, 1]).tolist() == [0, 0, -1]


def test_a_batch_without_a_manifest_is_an_error(tmp_path):
    assert "batch.yaml: is not there" in str(errors(read_manifest(tmp_path)[1])[0])


@pytest.mark.parametrize(
    ("lines", "severity", "message"),
    [
        ("tolerances: {flatness_um: {upper: 50}}", None, ""),
        (
            "tolerances: {flatness_um: {lower: 60, upper: 50}}",
            "error",
            "the lower limit below",
        ),
        ("tolerances: {flatness: {upper: 50}}", "error", 'did you mean "?flatness_um'),
        ("tolerances: {flatness_um: {}}", "error", "tolerances.flatness_um: found"),
        ("tolerances: {flatness_um: 50}", "error", "expected keys with values"),
        ("measurement: {operator: A. Smith, date: 2026-11-24, temperature_c: 20.5}", None, ""),
        ("measurement: {date: 24.11.2026}", "error", "expected a date, YYYY-MM-DD"),
        ("measurement: {temperature_c: 293}", "error", "measurement.temperature_c: found 293"),
    ],
)
def test_tolerances_and_the_measurement_are_checked(batch, lines, severity, message):
    edit(batch / "batch.yaml", "cell: bench", f"cell: bench\n{lines}")
    found = [
        f for f in read_manifest(batch)[1] if f.column and f.column.startswith(("tolerances", "measurement"))
    ]
    assert [f.severity for f in found] == ([severity] if severity else [])
    assert not found or re.search(message, str(found[0]))


def test_a_calibration_that_was_due_before_the_measurement_is_a_warning(batch):
    edit(batch / "batch.yaml", "cell: bench", "cell: bench\nmeasurement: {date: 2026-11-24}")
    content = yaml.safe_load((batch / "batch.yaml").read_text())
    content["measurement"]["date"] = "2026-11-24"
    for due, expected in (("2026-11-23", ["warning"]), ("2026-11-24", [])):
        content["instruments"] = {"dynamometer": {"calibration_due": due}}
        (batch / "batch.yaml").write_text(yaml.safe_dump(content))
        found = [f for f in read_manifest(batch)[1] if str(f.column).endswith("calibration_due")]
        assert [f.severity for f in found] == expected
