"""Faults of the tables that people write: what single cells, rows and the whole say."""

import pandas as pd
from corpus_case import Case, replaced, tabled


def cases():
    """Return the cases of runs, impacts, loads, mass, stations and published."""
    return [*_runs(), *_impacts(), *_loads(), *_others()]


def _set(table_file, row, **cells):
    def change(table):
        for column, value in cells.items():
            table[column] = (table[column] if column in table else pd.Series("", table.index)).astype(object)
            table.loc[row, column] = value

    return tabled(table_file, change)


def _all(file, **factors):
    def change(table):
        for column, factor in factors.items():
            table[column] = table[column] * factor

    return tabled(file, change)


def _run(fault, says, how="refused", **cells):
    return Case("runs.csv", "", fault, _set("runs.csv", 1, **cells), how, says)


def _linked(folder):
    (folder.parent / "else.csv").write_bytes((folder / "dynamometer/r2.csv").read_bytes())
    (folder / "dynamometer/link.csv").symlink_to(folder.parent / "else.csv")
    replaced("runs.csv", "dynamometer/r2.csv", "dynamometer/link.csv")(folder)


def _runs():
    at = "row 3"
    found = [
        _run("an id twice", (at, "r1", "row 2", "each once"), run="r1"),
        _run("a place in the order twice", (at, "order", "each once"), order=1),
        _run("an unknown role", (at, "role", "train", "expected identify or validate"), role="train"),
        _run("an unknown operation", (at, "operation", "drill", "expected"), operation="drill"),
        _run("a misspelt operation", (at, "operation", '"side"'), operation="sied"),
        _run("a_e > D", (at, "radial_depth_mm", "12", "tool.diameter_mm"), radial_depth_mm=12),
        _run("a slot of less than D", (at, "radial_depth_mm", "slot"), operation="slot", direction="slot"),
        _run(
            "up milling in a slot",
            (at, "direction", "slot"),
            operation="slot",
            radial_depth_mm=10,
            direction="up",
        ),
        _run("a slot's direction at a side", (at, "direction", "expected up or down"), direction="slot"),
        _run(
            "a negative feed",
            (at, "feed_per_tooth_mm", "-0.05", "expected 1e-5 to 50 mm"),
            feed_per_tooth_mm=-0.05,
        ),
        _run("a feed of nought", (at, "feed_per_tooth_mm", "expected 1e-5 to 50 mm"), feed_per_tooth_mm=0),
        _run("a feed in metres", (at, "feed_per_tooth_mm", "5e-05", "metres"), feed_per_tooth_mm=5e-5),
        _run("a feed in micrometres", (at, "feed_per_tooth_mm", "50", "expected"), feed_per_tooth_mm=50),
        _run("a feed in mm/min", (at, "feed_per_tooth_mm", "1200", "expected"), feed_per_tooth_mm=1200),
        _run("a depth in metres", (at, "axial_depth_mm", "0.001", "metres"), axial_depth_mm=0.001),
        _run("a depth in micrometres", (at, "axial_depth_mm", "1000", "expected"), axial_depth_mm=1000),
        _run("a negative depth", (at, "axial_depth_mm", "-1", "expected"), axial_depth_mm=-1),
        _run("a width in metres", (at, "radial_depth_mm", "0.005", "metres"), radial_depth_mm=0.005),
        _run("a length in metres", (at, "cut_length_mm", "0.06", "metres"), cut_length_mm=0.06),
        _run("a negative length", (at, "cut_length_mm", "-60", "expected"), cut_length_mm=-60),
        _run("a speed of nought", (at, "spindle_rpm", "expected 1 to 500000 rpm"), spindle_rpm=0),
        _run("a speed backwards", (at, "spindle_rpm", "-6000", "expected"), spindle_rpm=-6000),
        _run(
            "helical without an orbit", (at, "orbit_rpm", "expected"), operation="helical", direction="slot"
        ),
        _run(
            "helical without a hole",
            (at, "hole_diameter_mm"),
            operation="helical",
            direction="slot",
            orbit_rpm=9,
        ),
        _run("half a replicate", (at, "replicate", "1.5", "expected an integer"), replicate=1.5),
        _run("a negative order", (at, "order", "-2", "expected"), order=-2),
        _run("a judgement in doubt", (at, "stable", "maybe", "expected yes or no"), stable="maybe"),
        _run("a date of a German spreadsheet", (at, "started_at", "ISO 8601"), started_at="24.12.2024 08:00"),
        _run("a date as a serial number", (at, "started_at", "45650.3", "ISO 8601"), started_at="45650.3"),
        _run("a date of an American spreadsheet", (at, "started_at", "ISO 8601"), started_at="12/24/24 8:00"),
        _run(
            "a file that is not there", (at, "dynamometer", "is not there"), dynamometer="dynamometer/r9.csv"
        ),
        _run("a file of another case of letters", (at, "is not there"), dynamometer="Dynamometer/R2.csv"),
        _run("a path out of the batch", (at, "leads outside"), dynamometer="../specimen/dynamometer/r2.csv"),
        _run("an absolute path", (at, "leads outside"), dynamometer="/etc/passwd"),
        _run("a path of Windows", (at, "backslashes", "with /"), dynamometer="dynamometer\\r2.csv"),
        _run("a path of a drive", (at, "dynamometer"), dynamometer="C:/data/r2.csv"),
        _run("a path with a NUL", (at, "NUL"), dynamometer="dynamometer/r2\0.csv"),
        _run("a path beyond any length", (at, "dynamometer"), dynamometer="x" * 5000),
        _run("a folder as a file", (at, "is a folder"), dynamometer="dynamometer"),
        _run("the table itself as a recording", (at, "lacks the column"), dynamometer="runs.csv"),
        _run("a format that is not read", (at, "expected"), dynamometer="batch.yaml"),
        _run(
            "one recording of two runs",
            ("r1.csv", "r2", "has the same values as"),
            dynamometer="dynamometer/r1.csv",
        ),
        _run(
            "one condition of two settings",
            ("condition", "f0.04", "different settings"),
            "flagged",
            condition="f0.04",
        ),
        _run("one settings of two conditions", ("same settings",), "flagged", feed_per_tooth_mm=0.04),
        _run("no id", (at, "run", "is blank", "expected"), run=""),
        Case("runs.csv", "", "a link out of the batch", _linked, "refused", (at, "link", "outside")),
        Case(
            "runs.csv",
            "",
            "an unknown column",
            _set("runs.csv", 1, coolant="on"),
            "flagged",
            ("coolant", "not read"),
        ),
    ]
    both = tabled("runs.csv", lambda t: t.assign(role=["identify", "validate", "identify"], condition="a"))
    found.append(Case("runs.csv", "", "a condition of both roles", both, "flagged", ("role", "both roles")))
    return found


def _impact(fault, says, how="refused", /, row=0, **cells):
    return Case("impacts.csv", "", fault, _set("impacts.csv", row, **cells), how, says)


def _impacts():
    at = "row 2"
    return [
        _impact("no file", (at, "file", "is blank", "expected"), file=""),
        _impact("a file that is not there", (at, "file", "is not there"), file="impacts/r7.csv"),
        _impact("a path out of the batch", (at, "leads outside"), file="../x.csv"),
        _impact("an unknown kind", (at, "kind", "tap", "expected record or frf"), kind="tap"),
        _impact("no kind", (at, "kind", "is blank"), kind=""),
        _impact("a record that is said to be an FRF", (at, "frequency_hz"), kind="frf"),
        _impact("an FRF that is said to be a record", ("row 3", "force_n"), row=1, kind="record"),
        _impact("no unit", (at, "response_unit", "is blank", "expected"), response_unit=""),
        _impact("a unit that is not one", (at, "response_unit", "mm/s2", "expected"), response_unit="mm/s2"),
        _impact("a unit as people print it", (at, "response_unit", "m/s²", "expected"), response_unit="m/s²"),
        _impact("no reference", (at, "reference", "is blank", "expected"), reference=""),
        _impact("a point without an axis", (at, "response", "a point and an axis"), response="1"),
        _impact("an axis that is none", (at, "response", "1w", "a point and an axis"), response="1w"),
        _impact("a replicate of nought", (at, "replicate", "expected 1 to 1000000"), replicate=0),
        _impact("one file in two rows", ("row 3", "frequency_hz"), row=1, file="impacts/r1.csv", kind="frf"),
        _impact(
            "one record of two rows",
            ("impacts.csv", "has the same values as"),
            row=1,
            file="impacts/r1.csv",
            kind="record",
            response_unit="m/s2",
        ),
    ]


def _loads():
    at = "row 2"
    file = "loads.csv"

    def load(fault, says, how="refused", **cells):
        return Case(file, "", fault, _set(file, 0, **cells), how, says)

    def scaled(fault, says, **factors):
        return Case(file, "", fault, _all(file, **factors), "refused", says)

    angles = tabled(file, lambda t: t.assign(q1_deg=10.0, q2_deg=None))
    radians = tabled(file, lambda t: t.assign(**{f"q{i}_deg": 0.2 * i for i in range(1, 7)}))
    nowhere = tabled(file, lambda t: t.drop(columns=["x_mm", "y_mm", "z_mm"]))
    return [
        load("no load", (at, "the load is zero", "expected a force"), fx_n=0),
        load("no answer", (at, "blank", "expected at least one"), dx_mm="", dy_mm="", dz_mm=""),
        load("a move against its load", (at, "against"), dx_mm=-0.5),
        load("a replicate of nought", (at, "replicate", "expected"), replicate=0),
        load("a scatter of nought", (at, "sigma_mm", "expected 1e-9 to 1000 mm"), sigma_mm=0),
        scaled("forces in kN", ("fx_n", "kN"), fx_n=1e-3, fy_n=1e-3, fz_n=1e-3),
        scaled("displacements in metres", ("dx_mm", "metres"), dx_mm=1e-3, dy_mm=1e-3, dz_mm=1e-3),
        scaled("displacements in micrometres", ("dx_mm", "micrometres"), dx_mm=1e3, dy_mm=1e3, dz_mm=1e3),
        scaled("places in metres", ("x_mm", "metres"), x_mm=1e-3, y_mm=1e-3),
        Case(file, "", "one joint angle of six", angles, "refused", ("q1_deg", "expected q1_deg to q6_deg")),
        Case(file, "", "joint angles in radians", radians, "refused", ("q1_deg", "radians")),
        Case(file, "", "nowhere", nowhere, "flagged", ("neither joint angles nor",)),
    ]


def _others():
    mass, stations, printed = "mass.csv", "stations.csv", "published.csv"

    def one(file, fault, says, how="refused", **cells):
        return Case(file, "", fault, _set(file, 0, **cells), how, says)

    grams = dict.fromkeys(("mxx", "mxy", "mxz", "myy", "myz", "mzz"), 1e3)
    return [
        one(mass, "a matrix that is not positive definite", ("row 2", "positive definite"), mxz=1000),
        one(mass, "a negative mass", ("row 2", "mxx", "expected 1e-6 to"), mxx=-650),
        one(mass, "a mass of nought", ("row 2", "mzz", "expected 1e-6 to"), mzz=0),
        one(mass, "half a matrix", ("row 2", "myz", "is blank", "expected"), myz=""),
        Case(mass, "", "in grams", _all(mass, **grams), "refused", ("row 2", "mxx", "grams")),
        Case(
            mass,
            "",
            "in tonnes",
            _all(mass, **dict.fromkeys(grams, 1e-3)),
            "refused",
            ("row 2", "mxx", "tonnes"),
        ),
        one(
            mass,
            "a place twice with other values",
            ("row 3", "row 2"),
            "refused",
            point="b",
            x_mm=50,
            y_mm=30,
        ),
        one(stations, "a position twice", ("row 3", "position", "twice"), position=2),
        one(stations, "a stiffness of nought", ("row 2", "kx_n_um", "expected 0.001 to"), kx_n_um=0),
        one(stations, "a negative stiffness", ("row 2", "ky_n_um", "expected"), ky_n_um=-31),
        one(stations, "no place", ("row 2", "z_mm", "is blank", "expected"), z_mm=""),
        Case(
            stations,
            "",
            "in N/m",
            _all(stations, kx_n_um=1e6, ky_n_um=1e6, kz_n_um=1e6),
            "refused",
            ("row 2", "kx_n_um", "N/m"),
        ),
        one(
            printed,
            "nothing printed",
            ("row 2", "measured", "expected at least one"),
            measured="",
            predicted="",
        ),
        one(printed, "no unit", ("row 2", "unit", "is blank", "expected"), unit=""),
        one(printed, "no quantity", ("row 2", "quantity", "is blank", "expected"), quantity=""),
    ]
