"""Every table that the three papers print, digit by digit against its transcription in data/raw/*-published.

The papers are no part of the repository. Their texts are read beside the real data, where somebody has them.
"""

import os
import re
from decimal import Decimal
from pathlib import Path

import pandas as pd
import pytest
import yaml

ROOT = Path(__file__).parents[2]
PAPERS = Path(os.environ.get("METRO_REAL_DATA", ROOT / "../shared/real")).parent / "seeds"
TEXTS = {"T": "000_*.txt", "K": "001_*.txt", "F": "002_*.txt"}
there = pytest.mark.skipif(
    not all(list(PAPERS.glob(pattern)) for pattern in TEXTS.values()),
    reason="the texts of the papers (folder seeds beside METRO_REAL_DATA) are not there",
)
BATCHES = {"T": "trimule-published", "K": "kr160-published", "F": "irb6640-published"}
# Tables of published.csv that are compared line by line below.
COMPARED = {"T": {"4", "6"}, "K": {"7", "8"}, "F": {"4", "5", "6", "7"}}
# Tables that stand in a batch's runs.csv or batch.yaml or in config/cells, not in published.csv.
ELSEWHERE = {"T": {"3"}, "K": {"1"}, "F": {"1", "2", "3"}}
# Tables that are in no batch. Of its tables 2 to 6, the copy of [K] has the captions only. No model uses the
# machine and the material of tables 1 and 2 of [T], nor the places without a stiffness of its table 5.
LEFT_OUT = {"T": {"1", "2", "5"}, "K": {"2", "3", "4", "5", "6"}, "F": set()}
REGION = 1500  # characters below a caption that belong to its table
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]\d+)?")
CAPTION = re.compile(r"^(?:<span[^>]*></span>)?\**Table\**\s*(\d+)\**\.?\s+(?=\S)", re.MULTILINE)


def paper(key: str) -> str:
    (path,) = PAPERS.glob(TEXTS[key])
    return path.read_text(encoding="utf-8").replace("−", "-")


def printed_lines(text: str, after: str, before: str = "") -> list[str]:
    """Return the lines of ``text`` after the last line that starts with ``after``, up to ``before``."""
    tail = text[text.rindex(after) + len(after) :]
    return (tail[: tail.index(before)] if before else tail).splitlines()


def transcribed(key: str) -> pd.DataFrame:
    """Return published.csv with its digits as they are written."""
    path = ROOT / "data/raw" / BATCHES[key] / "published.csv"
    return pd.read_csv(path, dtype=str, keep_default_na=False)


def table(key: str, name: str) -> pd.DataFrame:
    rows = transcribed(key)
    return rows[rows["table"] == name]


def manifest(key: str) -> dict:
    return yaml.safe_load((ROOT / "data/raw" / BATCHES[key] / "batch.yaml").read_text())


@there
@pytest.mark.parametrize("key", TEXTS)
def test_every_captioned_table_is_compared_or_named_as_left_out(key):
    text = paper(key)
    captions = {match[1]: text[match.end() : match.end() + REGION] for match in CAPTION.finditer(text)}
    transcribed_here = {name for name in transcribed(key)["table"] if "." not in name}
    assert set(captions) <= transcribed_here | ELSEWHERE[key] | LEFT_OUT[key]
    for name in transcribed_here - COMPARED[key]:
        printed = set(NUMBER.findall(captions[name]))
        assert set(table(key, name)["measured"]) - {""} <= printed, f"table {name}"


@there
def test_face_load_tests_table_5():
    rows = table("F", "5").assign(load=lambda t: t["quantity"].str.extract(r"(\d+) N", expand=False))
    made = [
        point + "".join(load + "".join(part["measured"]) for load, part in of.groupby("load", sort=False))
        for point, of in rows.groupby("row", sort=False)
    ]
    printed = [line for line in printed_lines(paper("F"), "Table 5. ", "Table 6. ") if re.match(r"P\d", line)]
    assert printed == made


@there
def test_face_path_table_6():
    place = re.compile(r"x (-?\d+) mm, y (-?\d+) mm, z (-?\d+) mm")
    made = []
    for _, row in table("F", "6").iterrows():
        at = "".join(f"{int(part):.3f}" for part in place.search(row["note"]).groups())
        made.append(f"{row['row']}{at}{row['predicted']}{row['measured']}{row['printed_error_percent']}%")
    printed = [
        line for line in printed_lines(paper("F"), "Table 6. ", "Table 7. ") if re.match(r"\d\d-", line)
    ]
    assert printed == made


@there
def test_face_indices_table_7():
    cells = {
        (int(row["row"].removeprefix("case ")), row["quantity"].replace("_", "")): "".join(
            (row["predicted"], row["measured"], row["printed_error_percent"])
        )
        for _, row in table("F", "7").iterrows()
    }
    made = []
    for case in range(1, 5):
        for index in ("Xm", "Xa", "Xg"):
            number = [str(n) if index == "Xm" else "" for n in (case, case + 4)]
            pair = (cells[case, index], cells[case + 4, index])
            made.append("".join(f"{n}{index}{cell}%" for n, cell in zip(number, pair, strict=True)))
    printed = [line for line in printed_lines(paper("F"), "Table 7. ") if re.match(r"\d?X[mag]", line)]
    assert printed == made


@there
def test_face_matrices_and_damping_of_section_3_1():
    text, rows = paper("F"), table("F", "3.1")
    pattern = r"{} {} \( P 25 \) = ([-\d. ]+)"
    for wrist in "AB":
        for short, quantity in (("Mr", "mass"), ("Kr", "stiffness"), ("Cr", "damping")):
            (found,) = re.findall(pattern.format(short, wrist), re.sub(r"\s+", " ", text))
            numbers = [Decimal(n) for n in found.split()]
            if quantity == "stiffness":  # the last two numbers are the factor 10 5, of which 5 is raised
                assert [str(n) for n in numbers[-2:]] == ["10", "5"]
                numbers = [n * 100000 for n in numbers[:9]]
            of = rows[(rows["row"] == f"P25 {wrist}") & (rows["quantity"] == f"{quantity} matrix")]
            entries = {axis: Decimal(value) for axis, value in zip(of["axis"], of["measured"], strict=True)}
            full = [entries.get("".join(sorted(i + j)), Decimal(0)) for i in "xyz" for j in "xyz"]
            assert numbers == full, f"{short}{wrist}"
    (coefficients,) = re.findall(r"a0\((\S+)\) and a1\((\S+)\)", text)
    assert list(rows.loc[rows["quantity"].isin(["a0", "a1"]), "measured"]) == list(coefficients)


@there
def test_face_machining_head_of_table_4_and_work_object_of_section_2_5():
    rows = table("F", "4")
    value = dict(zip(zip(rows["quantity"], rows["axis"], strict=True), rows["measured"], strict=True))
    made = []
    for axis, angle in zip("xyz", ("alpha", "beta", "gamma"), strict=True):
        letter = {"alpha": "α", "beta": "β", "gamma": "Ɣ"}[angle]
        parts = [value[name, axis] for name in ("centre of gravity", "moment of inertia", "position")]
        shown = "".join(f"{axis.upper()} = {part}" for part in parts)
        made.append(f"{shown}{letter} = {value[f'Euler angle {angle}', '']}")
    made[0] = value["mass", ""] + made[0]
    assert [line for line in printed_lines(paper("F"), "Table 4. ", "Table 5. ") if " = " in line] == made
    work = table("F", "2.5")["measured"]
    places = "; ".join(work[:3])
    angles = "; ".join(f"{angle}°" for angle in work[3:])
    assert f"values {places} (X, Y and Z in mm) and orientation angles {angles}" in paper("F")


@there
def test_face_design_and_scanner_of_tables_1_to_3():
    runs = pd.read_csv(ROOT / "data/raw" / BATCHES["F"] / "runs.csv", dtype=str)
    made = [
        f"{run.removeprefix('case')}{wrist}{location}{orientation}"
        for run, wrist, location, orientation in runs[["run", "wrist", "location", "orientation"]].itertuples(
            index=False
        )
    ]
    text = paper("F")
    assert [line for line in printed_lines(text, "Table 2. ", "Table 3. ") if re.match(r"\d", line)] == made
    levels = [f"{name}{''.join(sorted(set(runs[column])))}" for name, column in (
        ("Robot Wrist Configuration", "wrist"),
        ("Workpiece Location", "location"),
        ("Workpiece Orientation", "orientation"),
    )]  # fmt: skip
    assert printed_lines(text, "Table 1. ", "Table 2. ")[2:5] == levels
    scanner = manifest("F")["instruments"]["scanner"]
    printed = printed_lines(text, "Table 3. ", "Table 4. ")
    assert f"Point spacing (mm){scanner['spacing_mm']}" in printed
    assert f"Accuracy (1σ){scanner['sigma_mm']}" in printed


@there
def test_kuka_forces_of_table_7_and_deformations_of_table_8():
    text = paper("K").replace("$", "")
    head, tail = text[: text.index("**Table 7**")], text[text.index("**Table 8**") :]
    rows = [line.split("\t") for line in head.splitlines() if line.count("\t") == 9]
    printed = [[cell.strip() for cell in row[1:]] for row in rows if NUMBER.fullmatch(row[1].strip())]
    forces = table("K", "7").groupby("row", sort=False)
    columns = ["measured", "predicted", "printed_error_percent"]
    assert printed == [list(part[columns].to_numpy().ravel()) for _, part in forces]
    walls = [line.replace("%", "").split() for line in tail.splitlines() if re.match(r"[456]\t", line)]
    deformations = table("K", "8")
    made = deformations.assign(row=deformations["row"].str.removeprefix("test "))
    assert walls == made[["row", *columns]].to_numpy().tolist()


@there
def test_kuka_arm_of_table_1():
    text = paper("K").replace("$", "")
    rows = [
        line.split("\t")[1:]
        for line in printed_lines(text, "**Table 1**", "**Fig. 2**")
        if line[:1].isdigit()
    ]
    dh = yaml.safe_load((ROOT / "config/cells/kr160.yaml").read_text())["arm"]["dh"]
    # alpha and a of joint 6 are blank in print, and taken as 0
    assert [[Decimal(cell.strip() or "0") for cell in row] for row in rows] == [
        [Decimal(value) for value in row] for row in dh
    ]


@there
def test_trimule_coefficients_of_table_4_and_modes_of_table_6():
    text = paper("T")
    coefficients = table("T", "4")
    (line,) = [
        line for line in printed_lines(text, "Table 4. ", "In order to verify") if len(line.split()) == 8
    ]
    assert line.split() == list(coefficients["measured"])
    names = re.findall(r"^(K\S+)\s*$", "\n".join(printed_lines(text, "Table 4. ", line)), re.MULTILINE)
    assert names == [name.replace("_", "") for name in coefficients["row"]]
    modes = table("T", "6")
    made = [
        [row.removeprefix("mode "), *part["measured"]]
        for (_, row), part in modes.groupby(["axis", "row"], sort=False)
    ]
    lines = [line.split() for line in printed_lines(text, "Table 6. ", "4.3 ")]
    assert [line for line in lines if len(line) == 5 and all(map(NUMBER.fullmatch, line))] == made


@there
def test_trimule_tool_of_table_3():
    printed = " ".join(printed_lines(paper("T"), "Table 3 ", "In the experiment"))
    tool = manifest("T")["tool"]
    values = printed[printed.index("Values") :].split()
    assert values[1] == f"{tool['diameter_mm']}mm"
    assert values[4:6] == [f"{tool['helix_deg']}°", str(tool["teeth"])]
    assert f"{manifest('T')['hole_diameter_mm']} mm" in paper("T")
