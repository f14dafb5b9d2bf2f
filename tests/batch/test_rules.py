import pytest

from metro.batch import rules
from metro.batch.tables import read_table

IMPACTS = "test,position,reference,response,replicate,kind,file,response_unit\n"
LOADS = "pose,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm,fx_n,fy_n,fz_n,dx_mm,dy_mm,dz_mm\n"
MASS = "pose,mxx,mxy,mxz,myy,myz,mzz\n"
PUBLISHED = "table,row,observable,quantity,measured,predicted,unit\n"
STATIONS = "position,x_mm,y_mm,z_mm,kx_n_um,ky_n_um,kz_n_um\n"
ACROSS = STATIONS.strip() + ",kxy_n_um\n"
TOUCHES = "touched,x_mm,y_mm,z_mm,q1,q2,q3,q4,rx_deg,ry_deg,rz_deg\n"
PAYLOAD = (
    ",".join(["loaded", *(f"q{i}_deg" for i in range(1, 7)), *(f"tau{i}_nm" for i in range(1, 7))]) + "\n"
)
CHECKS = {
    "touches": rules.touch_findings,
    "payload": rules.payload_findings,
    "impacts": rules.impact_findings,
    "loads": rules.load_findings,
    "mass": rules.mass_findings,
    "published": rules.published_findings,
    "stations": rules.station_findings,
}


def faults(folder, name, text):
    (folder / f"{name}.csv").write_text(text)
    table, findings = read_table(folder, name)
    return "\n".join(map(str, [*findings, *CHECKS[name](table)]))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("impacts", IMPACTS + "t,1,1x,7z,1,record,a.csv,m/s2\nt,1,1x,7z,1,frf,b.csv,\n,,,,,,c.uff,\n"),
        ("loads", LOADS + "p1,0,90,-90,0,45,0,,,,100,0,0,0.1,,\np2,,,,,,,1,2,3,0,0,-50,,,-0.2\n"),
        ("mass", MASS + "p25,654.58,0,382.51,903.38,0,269.57\n"),
        ("published", PUBLISHED + "4,Ktc,force,coefficient,10145,,N/mm2\n"),
        ("stations", STATIONS + "1,0,0,0,1,2,3\n2,0,0,-320,1,2,3\n"),
        ("stations", ACROSS + "1,0,0,0,1,2,3,1.2\n2,0,0,-320,1,2,3,\n"),
        ("touches", TOUCHES + "pin,1300,20,700,0.6,0,0.8,0,,,\nprimary,1300,20,700,,,,,0,90,0\n"),
        ("payload", PAYLOAD + "yes,10,20,30,40,50,60,1,2,3,4,5,6\nno,10,20,30,40,50,60,1,2,3,4,5,6\n"),
    ],
)
def test_rows_that_follow_the_contract_pass(tmp_path, name, text):
    assert faults(tmp_path, name, text) == ""


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        (
            "impacts",
            IMPACTS + "t,1,1x,7z,1,record,a.csv,\n",
            "row 2 (t): column response_unit: is blank, expected m/s2",
        ),
        ("impacts", IMPACTS + "t,1,,7z,1,frf,a.csv,\n", "column reference: is blank"),
        ("impacts", IMPACTS + "t,1,1x,7z,1,,a.csv,m\n", "column kind: is blank"),
        ("impacts", IMPACTS + "t,1,x1,7z,1,frf,a.csv,m\n", 'found "x1", expected a point and an axis, as 1x'),
        (
            "impacts",
            IMPACTS + "t,1,1x,7z,1,frf,a.csv,mm\n",
            'column response_unit: found "mm", expected m/s2 or',
        ),
        ("impacts", IMPACTS + "t,1,1x,7z,1,frf,,m\n", "column file: is blank"),
        (
            "impacts",
            IMPACTS + "t,1,1x,7z,1,frf,a.csv,m\nt,1,2x,7z,1,frf,a.csv,m\n",
            '"a.csv" is also in row 2',
        ),
        (
            "loads",
            LOADS + "p1,0,90,,0,45,0,,,,100,0,0,0.1,,\n",
            "column q3_deg: is blank in every row, expected a number, since there is q4_deg",
        ),
        ("loads", LOADS + "p1,,,,,,,,,,100,0,0,0.1,,\n", "neither joint angles nor x_mm, y_mm, z_mm"),
        ("loads", LOADS + "p1,,,,,,,1,2,3,0,0,0,0.1,,\n", "column fx_n: the load is zero"),
        ("loads", LOADS + "p1,,,,,,,1,2,3,9,0,,0.1,,\n", "column fz_n: is blank, expected a number"),
        ("loads", LOADS + "p1,,,,,,,1,2,3,9,0,0,,,\n", "dx_mm, dy_mm, dz_mm are all blank"),
        ("mass", MASS + "p,1,2,0,1,0,1\n", "is not positive definite"),
        ("mass", MASS + "p,-1,0,0,1,0,1\n", 'column mxx: found "-1", expected 1e-6 to 1000000 kg'),
        (
            "published",
            PUBLISHED + "4,Ktc,force,coefficient,,,N/mm2\n",
            "measured and predicted are both blank",
        ),
        ("published", PUBLISHED + "4,Ktc,force,coefficient,1,,\n", "column unit: is blank"),
        (
            "stations",
            STATIONS + "1,0,0,0,1,2,0\n",
            'column kz_n_um: found "0", expected 0.001 to 100000 N/µm',
        ),
        (
            "stations",
            STATIONS + "1,0,0,0,1,2,3\n1,0,0,9,1,2,3\n",
            'row 3 (1): column position: position "1" appears',
        ),
        (
            "stations",
            ACROSS + "1,0,0,0,1,2,3,0\n2,0,0,9,1,2,3,1.5\n",
            "row 3 (2): column kxy_n_um: the stiffness across is so large that the end gives way",
        ),
    ],
)
def test_a_row_that_cannot_be_used_is_named(tmp_path, name, text, message):
    assert message in faults(tmp_path, name, text)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        (
            "touches",
            TOUCHES + "pin,1300,20,700,,,,,,,\n",
            "row 2 (pin): column q1: expected the orientation of the flange once",
        ),
        ("touches", TOUCHES + "pin,1300,20,700,1,0,0,0,0,90,0\n", "q1 to q4, or rx_deg, ry_deg and rz_deg"),
        (
            "touches",
            TOUCHES + "pin,1300,20,700,0.6,0,0.6,0,,,\n",
            "found a quaternion of length 0.8485, expected 1",
        ),
        ("touches", TOUCHES + "pin,1.3,0.02,0.7,1,0,0,0,,,\n", "they seem to be in metres, expected mm"),
        (
            "payload",
            PAYLOAD + "yes,10,20,30,40,50,60,1,2,3,4,5,6\n",
            "expected torques with and without the load",
        ),
        (
            "payload",
            PAYLOAD + "yes,1,1,1,1,1,1,1,2,3,4,5,6\nno,1,1,1,1,1,1,1,2,3,4,5,6\n",
            "in radians, expected degrees",
        ),
    ],
)
def test_what_is_wrong_with_touches_and_torques_is_said(tmp_path, name, text, said):
    assert said in faults(tmp_path, name, text)


def without_those_against_their_load(folder, rows):
    (folder / "loads.csv").write_text(LOADS + "".join(f"{row}\n" for row in rows))
    return rules.with_their_load(read_table(folder, "loads")[0])


@pytest.mark.parametrize("second", ["100,0,0,0.2,,", "-50,0,0,-0.1,0.01,"])
def test_a_load_test_against_its_load_is_left_out_where_another_stands_in(tmp_path, second):
    rows = ["p,,,,,,,1,2,3,100,0,0,-0.2,,", f"p,,,,,,,1,2,3,{second}", "p,,,,,,,9,2,3,0,50,0,0,0.1,"]
    table, warnings = without_those_against_their_load(tmp_path, rows)
    assert table.rows == (3, 4)
    assert [warning.severity for warning in warnings] == ["warning"]
    said = str(warnings[0])
    assert said.startswith("loads.csv: row 2 (p): column dx_mm: the tip moves against its load")
    assert said.endswith("the row is left out, since row 3 loads the same place along the same line")
    assert not list(rules.load_findings(table))


@pytest.mark.parametrize(
    "second",
    [
        "p,,,,,,,1,2,4,100,0,0,0.2,,",  # another place
        "o,,,,,,,1,2,3,100,0,0,0.2,,",  # another pose
        "p,,,,,,,1,2,3,0,100,0,,0.2,",  # along another line
        "p,,,,,,,1,2,3,50,0,0,-0.1,,",  # against its load too
    ],
)
def test_a_load_test_against_its_load_refuses_the_batch_where_nothing_stands_in(tmp_path, second):
    table, warnings = without_those_against_their_load(tmp_path, ["p,,,,,,,1,2,3,100,0,0,-0.2,,", second])
    assert (table.rows, warnings) == ((2, 3), [])
    said = [str(finding) for finding in rules.load_findings(table)]
    assert "row 2 (p): column dx_mm: the tip moves against its load" in said[0]
    assert "no other row loads the same place along the same line" in said[0]


def test_load_tests_of_which_no_place_is_known_do_not_stand_in_for_each_other(tmp_path):
    rows = ["p,,,,,,,,,,100,0,0,-0.2,,", "p,,,,,,,,,,100,0,0,0.2,,"]
    assert without_those_against_their_load(tmp_path, rows)[0].rows == (2, 3)


def test_a_table_without_rows_keeps_the_numbers_and_the_faults_of_the_others(tmp_path):
    (tmp_path / "loads.csv").write_text(
        LOADS + "a,,,,,,,1,2,3,1,0,0,1,,\nb,,,,,,,1,2,3,x,0,0,1,,\nc,,,,,,,1,2,3,1,0,0,1,,\n"
    )
    table = read_table(tmp_path, "loads")[0].without({0})
    assert (list(table.frame["pose"]), table.rows, table.faulty) == (["b", "c"], (3, 4), {0})
