"""Faults of batch.yaml and cell.yaml: of the language, and of what the keys hold."""

from corpus_case import Case, replaced

BOMB = "title: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{b}{b}: &{b} [{', '.join([f'*{a}'] * 9)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
TO_WORK = "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"
TOOL_AXES = "[[0, 0, -1], [0, -1, 0], [-1, 0, 0]]"
AXES = "axes: {x: x, y: y, z: z}"

# Fault → what stands in the sound batch.yaml, what stands there instead, what a message must hold.
MANIFEST = {
    "a key is misspelt": ("diameter_mm: 10", "diamter_mm: 10", "diamter_mm", "diameter_mm"),
    "an unknown section": ("format: 1", "format: 1\ncoolant: dry", "coolant"),
    "a missing key": ("source: measured\n", "", "source", "expected"),
    "a later format": ("format: 1", "format: 2", "format", "2", "expected 1"),
    "the name of another batch": ("batch: specimen", "batch: another", "another", "specimen"),
    "a source that is none": ("source: measured", "source: guessed", "guessed", "expected"),
    "published, without a citation": ("source: measured", "source: published", "citation"),
    "a cell with a slash": ("cell: bench-arm", "cell: ../../etc/passwd", "cell", "expected"),
    "a number in words": ("teeth: 4", "teeth: four", "tool.teeth", "four", "expected an integer"),
    "half a tooth": ("teeth: 4", "teeth: 3.5", "tool.teeth", "3.5", "expected"),
    "no teeth": ("teeth: 4", "teeth: 0", "tool.teeth", "expected"),
    "a leading zero (octal to YAML)": ("teeth: 4", "teeth: 010", "line 6", "010", "expected"),
    "a colon (sexagesimal to YAML)": ("overhang_mm: 40", "overhang_mm: 1:30", "line 6", "1:30", "expected"),
    "a hexadecimal number": ("overhang_mm: 40", "overhang_mm: 0x28", "line 6", "0x28", "expected"),
    "an underscore in a number": ("overhang_mm: 40", "overhang_mm: 4_0", "line 6", "4_0", "expected"),
    "a negative diameter": ("diameter_mm: 10", "diameter_mm: -10", "diameter_mm", "-10", "expected"),
    "NaN": ("diameter_mm: 10", "diameter_mm: .nan", "nan", "finite"),
    "an infinite number": ("diameter_mm: 10", "diameter_mm: .inf", "inf", "finite"),
    "an overflowing number": ("diameter_mm: 10", "diameter_mm: 1e999", "1e999", "finite"),
    "a number in quotes": ("diameter_mm: 10", 'diameter_mm: "10"', "diameter_mm", "expected a number"),
    "a unit behind a number": ("diameter_mm: 10", "diameter_mm: 10 mm", "diameter_mm", "10 mm", "expected"),
    "a decimal comma": ("[212.5, 0.0, 279.9]", "[212,5, 0,0, 279,9]", "tool_in_flange_mm", "expected"),
    "a decimal comma in braces": (
        "diameter_mm: 10",
        "diameter_mm: 12,5",
        "diameter_mm",
        "12,5",
        "write 12.5",
    ),
    "two decimal commas that end alike": (
        "overhang_mm: 40",
        "overhang_mm: 40,5, x: 12,5",
        "overhang_mm",
        "40,5",
        "write 40.5",
    ),
    "a comma for thousands": ("rate_hz: 1000", "rate_hz: 8,192", "rate_hz", "8,192", "write 8192 or 8.192"),
    "commas for millions": ("range_n: 5000", "range_n: 1,000,000", "range_n", "write 1000000"),
    "a misspelt instrument": ("dynamometer:", "dynamometr:", "dynamometr", "dynamometer"),
    "a misspelt section": ("instruments:", "instrument:", "instrument", "instruments"),
    "a singular for a plural": (AXES, "axis: {x: x, y: y, z: z}", "dynamometer.axis", "axes"),
    "two letters exchanged": ("rate_hz: 1000", "raet_hz: 1000", "dynamometer.raet_hz", "rate_hz"),
    "a key without its unit": ("rate_hz: 1000", "rotation: 30", "dynamometer.rotation", "rotation_deg"),
    "a key with another unit": ("range_n: 5000", "range_kn: 5", "dynamometer.range_kn", "range_n"),
    "a key of another program": ("rate_hz: 1000", "model: 9257B", "dynamometer.model", "not a known key"),
    "an instrument of another program": (
        "  hammer:",
        "  microphone: {rate_hz: 44100}\n  hammer:",
        "instruments.microphone",
        "not a known key",
    ),
    "two coordinates of three": ("[212.5, 0.0, 279.9]", "[212.5, 0.0]", "tool_in_flange_mm", "expected"),
    "yes where text is due": ("title: A sound little batch", "title: yes", "title", "expected text"),
    "a blank value": ("diameter_mm: 10", "diameter_mm: ", "diameter_mm", "expected"),
    "a helix of 95°": ("helix_deg: 30", "helix_deg: 95", "helix_deg", "95", "expected"),
    "a pitch angle too few": ("[90, 90, 90, 90]", "[120, 120, 120]", "pitch_deg", "3", "expected"),
    "pitch angles that do not close": ("[90, 90, 90, 90]", "[90, 90, 90, 80]", "350", "expected 360"),
    "pitch angles in radians": ("[90, 90, 90, 90]", "[1.571, 1.571, 1.571, 1.571]", "6.284", "expected 360"),
    "a diameter in metres": ("diameter_mm: 10", "diameter_mm: 0.010", "tool.diameter_mm", "0.01", "metres"),
    "an overhang in metres": ("overhang_mm: 40", "overhang_mm: 0.040", "tool.overhang_mm", "0.04", "metres"),
    "a work in metres": ("[60, 40, 20]", "[0.06, 0.04, 0.02]", "work.size_mm", "metres"),
    "a tool tip in metres": ("[212.5, 0.0, 279.9]", "[0.2125, 0.0, 0.2799]", "tool_in_flange_mm", "metres"),
    "a work's place in metres": ("[1200, 0, 500]", "[1.2, 0, 0.5]", "work_in_base", "metres"),
    "left-handed sensor axes": (AXES, "axes: {x: x, y: y, z: -z}", "axes", "left-handed", "expected"),
    "one sensor axis twice": (AXES, "axes: {x: x, y: x, z: z}", "axes", "twice", "expected"),
    "a sensor axis that is none": (AXES, "axes: {x: up, y: y, z: z}", "up", "expected"),
    "a misspelt sensor axis": (AXES, "axes: {X: x, y: y, z: z}", "axes.X", "x"),
    "a dynamometer that reads neither": ("reads: work", "reads: table", "reads", "table", "expected"),
    "a rate of zero": ("rate_hz: 1000", "rate_hz: 0", "rate_hz", "expected"),
    "a left-handed tool": (
        TOOL_AXES,
        "[[0, 0, 1], [0, -1, 0], [-1, 0, 0]]",
        "tool_axes_in_flange",
        "left-handed",
    ),
    "tool axes of other lengths": (
        TOOL_AXES,
        "[[0, 0, -0.5], [0, -1, 0], [-1, 0, 0]]",
        "perpendicular",
        "expected",
    ),
    "a mirrored scanner": (
        TO_WORK,
        TO_WORK.replace("[0, 0, 1, 0]", "[0, 0, -1, 0]"),
        "to_work",
        "left-handed",
    ),
    "a scanner that scales": (TO_WORK, TO_WORK.replace("1, 0, 0, 0", "1000, 0, 0, 0"), "to_work", "expected"),
    "a transposed transformation": (
        TO_WORK,
        "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [5, 0, 0, 1]]",
        "to_work",
        "last row",
    ),
    "an effect that does not exist": (
        "instruments:",
        "known: {tool_runuot: {radius_um: 5}}\ninstruments:",
        "tool_runuot",
        "tool_runout",
    ),
    "a parameter without its unit": (
        "instruments:",
        "known: {tool_runout: {radius: 7}}\ninstruments:",
        "known.tool_runout.radius",
        "expected radius_um, angle_deg",
    ),
    "a parameter with a decimal comma": (
        "instruments:",
        "known: {tool_runout: {radius_um: 7,35, angle_deg: 40}}\ninstruments:",
        "known.tool_runout.radius_um",
        "7,35",
        "expected a number",
    ),
    "an effect of a tenth joint": (
        "instruments:",
        "known: {friction_reversal: {joint: 10, torque_nm: 5}}\ninstruments:",
        "known.friction_reversal.joint",
        "10",
        "expected a joint, 1 to 9",
    ),
    "an effect that is told by half": (
        "instruments:",
        "known: {tool_runout: {radius_um: 7}}\ninstruments:",
        "known.tool_runout",
        "lacks angle_deg",
    ),
    "a limit of no column": (
        "instruments:",
        "limits: {axial: [1, 2]}\ninstruments:",
        "limits.axial",
        "axial_depth_mm",
    ),
    "limits the wrong way round": (
        "instruments:",
        "limits: {axial_depth_mm: [4, 1]}\ninstruments:",
        "limits.axial_depth_mm",
        "[4, 1]",
        "expected the least first",
    ),
    "coefficients in N/m2": (
        "instruments:",
        "coefficients: {ktc_n_mm2: 9.58e+8}\ninstruments:",
        "ktc_n_mm2",
        "958000000",
        "expected",
    ),
    "a key twice": ("teeth: 4", "teeth: 4, teeth: 3", "teeth", "twice"),
    "a section twice": ("format: 1", "format: 1\nwork: {material: steel}", "work", "twice"),
    "a tab as indentation": ("  hammer", "\thammer", "line"),
    "a bracket that does not close": ("[60, 40, 20]", "[60, 40, 20", "line"),
    "a tag of Python": ("format: 1", "format: !!python/object/apply:os.getcwd []", "python"),
    "a tag of its own": ("format: 1", "format: !secret 1", "!secret"),
    "a merge of an anchor": ("title: A sound", "x: &a {teeth: 3}\ny: {<<: *a}\ntitle: A sound", "alias"),
    "an anchor that holds itself": ("title: A sound little batch", "title: &a [*a]", "alias"),
    "two documents": ("title:", "---\ntitle:", "document"),
}
FLAGGED = (
    "an unknown section",
    "a key of another program",
    "an instrument of another program",
    "an effect that is told by half",
)
ARM = (
    "[[0, 90, 500, 250], [90, 0, 0, 610], [-180, -90, 0, 70], [0, 90, 710, 0], "
    "[0, -90, 0, 0],\n       [0, 0, 215, 0]]"
)
METRES = (
    "[[0, 90, 0.5, 0.25], [90, 0, 0, 0.61], [-180, -90, 0, 0.07], [0, 90, 0.71, 0], "
    "[0, -90, 0, 0], [0, 0, 0.215, 0]]"
)
RADIANS = (
    "[[0, 1.571, 500, 250], [1.571, 0, 0, 610], [-3.142, -1.571, 0, 70], [0, 1.571, 710, 0], "
    "[0, -1.571, 0, 0], [0, 0, 215, 0]]"
)
STIFFNESS = "[1.0e+6, 1.1e+6, 9.0e+5, 2.0e+5, 1.8e+5, 1.5e+5]"
CELL = {
    "another cell": ("cell: bench-arm", "cell: kr160", "kr160", "bench-arm"),
    "five joints": (ARM, ARM.replace(",\n       [0, 0, 215, 0]", ""), "joint_stiffness_nm_rad", "expected 5"),
    "three numbers for a joint": (ARM, ARM.replace("[0, 0, 215, 0]", "[0, 0, 215]"), "arm.dh", "expected"),
    "an arm in metres": (ARM, METRES, "arm.dh", "metres"),
    "an arm in radians": (ARM, RADIANS, "arm.dh", "radians"),
    "a negative stiffness": (
        STIFFNESS,
        STIFFNESS.replace("1.1e+6", "-1.1e+6"),
        "joint_stiffness",
        "expected",
    ),
    "five stiffnesses": (
        STIFFNESS,
        "[1.0e+6, 1.1e+6, 9.0e+5, 2.0e+5, 1.8e+5]",
        "joint_stiffness",
        "expected",
    ),
    "a stiffness in words": (STIFFNESS, "stiff", "joint_stiffness", "stiff", "expected"),
    "a misspelt key": (
        "joint_stiffness_nm_rad",
        "joint_stifness_nm_rad",
        "joint_stifness",
        "joint_stiffness_nm_rad",
    ),
    "a key twice": ("cell: bench-arm", "cell: bench-arm\ncell: bench-arm", "cell", "twice"),
    "stations that are not there": (
        "cell: bench-arm",
        "cell: bench-arm\nstations: s.csv",
        "s.csv",
        "is not there",
    ),
    "stations out of the batch": (
        "cell: bench-arm",
        "cell: bench-arm\nstations: ../s.csv",
        "../s.csv",
        "expected",
    ),
    "stations at the root": (
        "cell: bench-arm",
        "cell: bench-arm\nstations: /etc/passwd",
        "/etc/passwd",
        "expected",
    ),
    "a tag of Python": (STIFFNESS, "!!python/name:os.system", "python"),
}


def cases():
    """Return the cases of both files."""
    found = [_replaced("batch.yaml", fault, *case) for fault, case in MANIFEST.items()]
    found += [_replaced("cell.yaml", fault, *case) for fault, case in CELL.items()]
    for file in ("batch.yaml", "cell.yaml"):
        found += _of_the_file(file)
    return found


def _replaced(file, fault, old, new, *says):
    how = "flagged" if fault in FLAGGED else "refused"
    return Case(file, "", fault, replaced(file, old, new), how, says)


def _of_the_file(file):
    def made(change):
        def apply(folder):
            text = change((folder / file).read_text())
            (folder / file).write_bytes(text if isinstance(text, bytes) else text.encode())

        return apply

    return [
        Case(file, "", "a byte-order mark", made(lambda t: b"\xef\xbb\xbf" + t.encode()), "read"),
        Case(file, "", "CRLF line ends", made(lambda t: t.replace("\n", "\r\n")), "read"),
        Case(file, "", "UTF-16", made(lambda t: t.encode("utf-16")), "refused", ("UTF-8",)),
        Case(file, "", "latin-1", made(lambda t: f"# 20 °C\n{t}".encode("latin-1")), "refused", ("UTF-8",)),
        Case(file, "", "a control character", made(lambda t: t.replace(": ", ": \x07", 1)), "refused"),
        Case(file, "", "a list", made(lambda _: "- a\n- b\n"), "refused", ("expected keys with values",)),
        Case(
            file, "", "text", made(lambda _: "see the notebook\n"), "refused", ("expected keys with values",)
        ),
        Case(
            file,
            "",
            "a bomb of anchors",
            made(lambda t: t.replace("title:", "x:") + BOMB),
            "refused",
            ("alias",),
        ),
        Case(file, "", "brackets without end", made(lambda _: "a: " + "[" * 20000), "refused"),
        Case(file, "", "brackets within brackets", made(lambda _: f"a: {'[' * 5000}{']' * 5000}"), "refused"),
    ]
