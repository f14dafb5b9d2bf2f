"""Faults of text tables, as programs, spreadsheets and people make them: the same list for every one."""

import corpus_batches as batches
from corpus_case import Case

# Kind → a column of numbers that must be filled, and whether it is a table that people write.
TABLES = {
    "runs.csv": "spindle_rpm",
    "impacts.csv": "replicate",
    "loads.csv": "fx_n",
    "mass.csv": "mxx",
    "stations.csv": "kx_n_um",
    "published.csv": "measured",
}
SIGNALS = {
    "dynamometer": "fx_n",
    "robot_log": "tau2_nm",
    "path": "x_mm",
    "profile": "z_mm",
    "hammer record": "response",
    "FRF": "real",
}
REQUIRED = {"runs.csv": "run", "impacts.csv": "file", "published.csv": "unit"}
FREE = ("runs.csv", "impacts.csv", "published.csv")  # their number may be blank where it does not apply
SAMPLES = ("dynamometer", "robot_log")  # a row of these that lacks a value is a sample that was lost
ROW = 2  # index of the row that is broken: line 3 of the file


def cases():
    """Return the cases of every table and every recording in CSV."""
    found = [case for kind, column in TABLES.items() for case in _faults(kind, "", column)]
    return found + [case for kind, column in SIGNALS.items() for case in _faults(kind, "CSV", column)]


def _lines(change):
    """Change the lines of the text, given as lists of cells."""

    def edit(text):
        rows = [line.split(",") for line in text.splitlines()]
        return "\n".join(",".join(row) for row in change(rows)) + "\n"

    return edit


def _cell(column, value):
    def change(rows):
        rows[ROW][rows[0].index(column)] = value
        return rows

    return _lines(change)


def _header(column, name):
    def change(rows):
        rows[0][rows[0].index(column)] = name
        return rows

    return _lines(change)


def _without(column):
    def change(rows):
        at = rows[0].index(column)
        return [row[:at] + row[at + 1 :] for row in rows]

    return _lines(change)


def _twice(column):
    def change(rows):
        at = rows[0].index(column)
        return [[*row, row[at]] for row in rows]

    return _lines(change)


def _case(kind, form, fault, edit, told):
    how, says = told
    file = batches.victim(kind, form)

    def apply(folder):
        made = edit((folder / file).read_text())
        (folder / file).write_bytes(made if isinstance(made, bytes) else made.encode())

    return Case(kind, form, fault, apply, how, says)


def _faults(kind, form, column):
    table = kind in TABLES
    must = REQUIRED.get(kind, column)
    row = "row 3" if table else "line 3"
    alone = kind in (
        "runs.csv",
        "impacts.csv",
        "published.csv",
    )  # all that this sound batch has of measurements
    at = (row, column)

    def case(fault, edit, how="refused", says=()):
        return _case(kind, form, fault, edit, (how, tuple(says)))

    def either(of_table, of_signal):
        return of_table if table else of_signal

    def blank(fault, value):
        how, found = ("flagged", "lack a value") if kind in SAMPLES else ("refused", "expected")
        return case(fault, _cell(must, value), how, [row, must, found])

    return [
        case("columns parted by semicolons", lambda t: t.replace(",", ";"), says=["semicolons", "expected"]),
        case(
            "semicolons and decimal commas (a German spreadsheet)",
            lambda t: t.replace(",", ";").replace(".", ","),
            says=["semicolons"],
        ),
        case("decimal commas between commas", _commas, says=["expected"]),
        case("a decimal comma in quotes", _cell(column, '"1,5"'), says=[*at, "1,5", "expected", "decimal"]),
        case("a thousands separator", _cell(column, '"1,234.5"'), says=[*at, "1,234.5", "expected"]),
        case("a byte-order mark", lambda t: b"\xef\xbb\xbf" + t.encode(), "read"),
        case("CRLF line ends", lambda t: t.replace("\n", "\r\n"), "read"),
        case("CR line ends (old Mac)", lambda t: t.replace("\n", "\r"), "read"),
        case("UTF-16", lambda t: t.encode("utf-16"), says=["UTF-8"]),
        case(
            "a column in latin-1",
            lambda t: _added(t, "temp °C", "20").encode("latin-1"),
            either("refused", "read"),
            either(["UTF-8"], []),
        ),
        case(
            "columns parted by tabs",
            lambda t: t.replace(",", "\t"),
            either("refused", "read"),
            either(["tabs"], []),
        ),
        case("lines before the header", lambda t: "Measured by,J. Doe\n" + t),
        case("no header", lambda t: t.split("\n", 1)[1]),
        case("a row of units below the header", _units, says=[either("row 2", "line 2"), "expected"]),
        case("a required column is missing", _without(must), says=[must, "expected"]),
        case("a required column is named otherwise", _header(must, f"my {must}"), says=[must, "expected"]),
        case("a column appears twice", _twice(column), says=[column]),
        case("columns in another order", _lines(lambda rows: [row[::-1] for row in rows]), "read"),
        blank("a blank cell", ""),
        case("text in a number", _cell(column, "high"), says=[*at, "high", "expected a"]),
        blank("not applicable", "n/a")
        if kind in SAMPLES
        else case("not applicable", _cell(column, "n/a"), says=[*at, "expected"]),
        blank("NaN", "NaN")
        if must == column and kind not in FREE
        else case("a nought for nothing", _cell(column, "-"), says=[*at, "expected"]),
        case("inf", _cell(column, "inf"), says=[*at, "inf", "expected"]),
        case("an enormous number", _cell(column, "1e999"), says=[*at, "expected"]),
        case("a date where a spreadsheet saw one", _cell(column, "2-Jan"), says=[*at, "2-Jan", "expected"]),
        blank("a spreadsheet's error", "#DIV/0!")
        if kind in SAMPLES
        else case("a spreadsheet's error", _cell(column, "#DIV/0!"), says=[*at, "expected"]),
        case("a unit behind a number", _cell(column, "12 N"), says=[*at, "12 N", "expected"]),
        case("digits of another script", _cell(column, "१२"), says=[*at, "expected"]),
        case("an underscore in a number", _cell(column, "1_000"), says=[*at, "1_000", "expected"]),
        case("cut off within its last row", _torn, "flagged" if kind == "runs.csv" else "refused"),
        case("a value too many in a row", _lines(_longer), says=[row, "expected"]),
        case("a NUL byte", lambda t: t.replace(",", ",\0", 9)),
        case("a quote that does not close", lambda t: t.replace("\n", '\n"', 3)),
        case("a blank line", lambda t: t.replace("\n", "\n\n", 2), "read"),
        case("spaces around the cells", lambda t: t.replace(",", " , "), "read"),
        case("the header a second time", lambda t: t + t, says=["expected"]),
        case(
            "no rows",
            lambda t: t.split("\n", 1)[0] + "\n",
            "refused" if alone else either("flagged", "refused"),
            ["nothing can be computed"] if alone else either(["no rows"], ["expected"]),
        ),
        case("a footer", lambda t: t + "End of file\n", "flagged" if kind == "runs.csv" else "refused"),
    ]


def _commas(text):
    assert "." in text
    header, rest = text.split("\n", 1)
    return f"{header}\n" + "\n".join(line.replace(".", ",") for line in rest.splitlines()) + "\n"


def _added(text, name, value):
    header, *rows = text.splitlines()
    return "\n".join([f"{header},{name}", *(f"{row},{value}" for row in rows)]) + "\n"


def _units(text):
    header, rest = text.split("\n", 1)
    return f"{header}\n" + ",".join("[-]" for _ in header.split(",")) + f"\n{rest}"


def _torn(text):
    *rows, last = text.splitlines()
    return "\n".join([*rows, last.split(",")[0]])


def _longer(rows):
    rows[ROW] = [*rows[ROW], "5"]
    return rows
