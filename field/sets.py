"""The sets: their files, what a user answers when they are brought in, and what is known of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from field.modes import mode, others
from field.taken import (
    Found,
    at,
    coefficient,
    effect,
    face,
    friction,
    held_out,
    posed,
    printed,
    probability,
    trace,
)
from metro.units import JSON


@dataclass(frozen=True)
class Known:
    """A figure that is known of a set, and where ours is in the results.

    Attributes
    ----------
    what, unit : in the table. value : what is known; None where only ours is listed. source : who says so.
    ours : takes ``identified`` and ``verdict`` and gives a quantity (value, ci95), or a list as text
        (listed); None where we have none.
    half : half width of what is known, by its rounding or its own interval.
    """

    what: str
    unit: str
    value: float | None
    source: str
    ours: Callable[[Found], JSON | None]
    half: float = 0.0


@dataclass(frozen=True)
class FieldSet:
    """A set of files.

    Attributes
    ----------
    name : of the batch that it becomes. files : patterns in its folder, in the order of import; none where
        the folder is a batch already. answers : to the questions of the import, options as they are given.
    known : what is compared. refused : words of the refusal, where the right end is one.
    remark : what the figures do not say. folder : beside the real data; "": field and its name.
    """

    name: str
    files: Sequence[str] = ()
    answers: Sequence[str] = ()
    known: Sequence[Known] = ()
    refused: str = ""
    remark: str = ""
    folder: str = ""


def texture(source: str, *values: tuple[str, str, float, float]) -> tuple[Known, ...]:
    """Known parameters of a trace: name, unit, value and half width of each."""
    return tuple(Known(name, unit, value, source, trace(name), half) for name, unit, value, half in values)


def modes(published: Sequence[float], source: str, half: float) -> tuple[Known, ...]:
    """Return published modes, one by one, and which of ours nobody published."""
    each = (Known(f"mode at {hz:g} Hz", "Hz", hz, source, mode(hz, published), half) for hz in published)
    return (*each, Known("modes that were not published", "", None, "", others(published)))


BEAM = "mean of single-FRF fits over nine places of the hammer"
BEAM_MODES = (111.99, 306.86, 596.37, 974.14)
TOOL_MODES = (1074.0, 1961.0, 2617.0)
SLOTTING = "published by the recorder: mean forces, all five feeds"
BALL = "by the name of the tool, ball 16"
UR10E = "published for this arm"
TOOL = "published: peaks picked by hand"
OF_QUICK_FIT = "a quick fit by hand, at random"
SWEEP = (
    "--set=unit.force=N",
    "--set=rate_hz=10000",
    "--set=tool.diameter_mm=16",
    "--set=tool.teeth=2",
    "--set=tool.helix_deg=25",
    "--set=dynamometer.reads=work",
    "--set=dynamometer.axes=none",
    "--set=operation=slot",
    "--set=direction=slot",
    "--run-column=spindle_rpm=800",
    "--run-column=feed_per_tooth_mm=0.1",
    "--run-column=axial_depth_mm={record}",
    "--run-column=radial_depth_mm=16",
)
SETS = (
    FieldSet(
        "force-ball-d16",
        ("ball_d16.mat",),
        SWEEP,
        (
            Known(
                "corner radius of the end", "mm", 8.0, BALL, effect("force", "tool_end", "corner_radius_mm")
            ),
            Known("error on held-out depths, after the loop", "%", None, "", held_out("force")),
        ),
        remark="a ball end of which diameter, teeth and helix alone are declared, and no axes: page one "
        "names the axes that the records have, with a ball end, and no cause is looked for before they are "
        "declared. "
        "The error is that of a fit under wrong axes, which has several optima and means nothing",
    ),
    FieldSet(
        "force-ball-declared",
        ("ball_d16.mat",),
        (*SWEEP, "--set=tool.end=ball"),
        (Known("error on held-out depths, after the loop", "%", None, "", held_out("force")),),
        folder="field/force-ball-d16",
        remark="the same with the end declared",
    ),
    FieldSet(
        "force-ball-axes",
        ("ball_d16.mat",),
        [each.replace("axes=none", "axes=y,x,-z") for each in SWEEP],
        (
            Known(
                "corner radius of the end", "mm", 8.0, BALL, effect("force", "tool_end", "corner_radius_mm")
            ),
            Known("probability that the end is no flat one", "1", None, "", probability("force", "tool_end")),
            Known("error on held-out depths, before the loop", "%", None, "", held_out("force", "before")),
            Known("error on held-out depths, after the loop", "%", None, "", held_out("force")),
        ),
        folder="field/force-ball-d16",
        remark="the axes as page one of force-ball-d16 proposes, the end undeclared. Against every other "
        "effect and against none the end has the weight 1.00; its probability is lower by the share of the "
        "residual that no effect explains. A free fit of all five depths with coefficients that change along "
        "the ball lowers the error of a depth left out from 12.7 to 8.7 %: three depths do not identify them",
    ),
    FieldSet(
        "force-ball-axes-end",
        ("ball_d16.mat",),
        [*(each.replace("axes=none", "axes=y,x,-z") for each in SWEEP), "--set=tool.end=ball"],
        (
            Known("error on held-out depths, before the loop", "%", None, "", held_out("force", "before")),
            Known("error on held-out depths, after the loop", "%", None, "", held_out("force")),
        ),
        folder="field/force-ball-d16",
        remark="axes and end declared",
    ),
    FieldSet(
        "modal-beam",
        ("Hxysv*.txt.gz",),
        ("--set=reference={number}z", "--set=response=1z"),
        modes(BEAM_MODES, BEAM, half=0.005),
    ),
    FieldSet(
        "modal-duplicated-channel",
        ("*.txt",),
        refused="hold the same numbers, bit for bit",
        remark="two acceleration files are copies of each other",
    ),
    FieldSet(
        "modal-poles-unv",
        ("*.unv",),
        ("--set=citation=GVT-Post-Processing, X-HALE",),
        (
            Known("first mode", "Hz", 0.763477, "data set 55, undamped", printed(0.763477), half=5e-7),
            Known("eleventh mode", "Hz", 8.059956, "data set 55, undamped", printed(8.059956), half=5e-7),
        ),
    ),
    FieldSet(
        "profile-square",
        ("square.xml",),
        (),
        texture(
            "software gauge, square wave",
            ("Pa", "µm", 1.0, 5e-4),
            ("Pq", "µm", 1.0, 5e-4),
            ("Pt", "µm", 2.0, 5e-4),
            ("PSm", "µm", 200.0, 5e-3),
            ("Pdq", "1", 0.2494, 5e-5),
        ),
    ),
    FieldSet(
        "robot-ur10e-payload",
        ("*.csv",),
        (
            "--set=joints.drive=14-19",
            "--set=unit.drive=A",
            "--set=unit.time=s",
            "--set=unit.angle=rad",
            "--set=loaded=no,yes",
            "--set=cell=ur10e",
            "--set=drives.torque_per_ampere_nm_a=10.0,10.70,8.46,9.00,9.48,10.12",
        ),
        (
            Known("payload", "kg", 2.805, "weighed", at("calibration", "payload", "mass"), half=5e-4),
            *(
                Known(
                    f"Coulomb friction of joint {i}", "N m", value, UR10E, friction("coulomb", i), half=half
                )
                for i, (value, half) in enumerate(
                    ((12.5, 0.05), (13.3, 0.05), (5.0, 0.05), (2.0, 0.05), (2.69, 5e-3), (2.30, 5e-3)), 1
                )
            ),
        ),
        remark="with the published drive constants, which by themselves give 2.46 kg",
    ),
    FieldSet(
        "robot-poses-ur10",
        ("grid/measurements_grid.csv", "random/measurements_random_poses.csv"),
        ("--set=unit.angle=rad", "--set=unit.length=mm", "--set=cell=ur10"),
        (
            Known(
                "random poses, nominal geometry", "mm", 0.89, OF_QUICK_FIT, posed("r02", "random", "nominal")
            ),
            Known("corrected geometry", "mm", 0.42, OF_QUICK_FIT, posed("r02", "random", "geometry")),
            *(
                Known(f"{name}, {kind} left out, with effects", "mm", None, "", posed(run, kind, "effects"))
                for run, name in (("r01", "grid"), ("r02", "random poses"))
                for kind in ("random", "region", "time")
            ),
        ),
        remark="median distances of poses that were left out; the quick fit reached 0.40 mm with gravity, "
        "eccentricity and the direction of torque",
    ),
    FieldSet(
        "scan-gocator",
        ("*.csv",),
        ("--set=work.size_mm=none",),
        (Known("noise of a point", "µm", 43.0, "about, of the plane", face("sigma"), half=5.0),),
        remark="the plane is cut out of the scene, and what is no face in it is named",
    ),
    FieldSet(
        "scan-numbered-points",
        ("*.csv",),
        ("--set=unit.length=mm", "--set=work.size_mm=none"),
        (Known("X_m", "µm", 123.3, "FlatnessScan, least squares", face("xm"), half=0.05),),
    ),
    FieldSet(
        "slotting-d25",
        known=(
            *(
                Known(f"{name} by mean forces", unit, value, SLOTTING, coefficient(name), half=5e-5)
                for name, unit, value in (
                    ("ktc", "N/mm²", 958.8599),
                    ("krc", "N/mm²", 250.8633),
                    ("kac", "N/mm²", 146.3614),
                    ("kte", "N/mm", 15.7580),
                    ("kre", "N/mm", 19.4337),
                    ("kae", "N/mm", 18.2075),
                )
            ),
            Known("error on held-out feeds, before the loop", "%", None, "", held_out("force", "before")),
            Known("error on held-out feeds, after the loop", "%", None, "", held_out("force")),
        ),
        folder="real/batches/slotting-d25",
    ),
    FieldSet(
        "tool-impact",
        known=modes(TOOL_MODES, TOOL, half=0.5),
        folder="real/batches/tool-impact",
        remark="the published figures are peaks of a structure with nine to fifteen modes. 1961 Hz is no "
        "pole: the five files by themselves have one at 1926 to 1946 Hz and the next at 2054 to 2242 "
        "Hz, so has the whole band, the second at 2057 ± 132 Hz, since single files do not tell it "
        "from its neighbours. The peak at 1074 Hz is that of two broad modes, 1067.0 ± 4.4 and 1103 ± "
        "11 Hz, beside a narrow one at 1059.3 Hz, which is in all five files and in the tail of the "
        "raw record",
    ),
    FieldSet(
        "granite-again",
        ("*007.csv",),
        ("--set=work.size_mm=none",),
        (Known("X_m", "µm", 124.0, "largest less least height", face("xm"), half=0.5),),
        folder="real/reference/granite",
        remark="the same plate once more: flat to a few µm, scanned with a scatter of 20 µm",
    ),
    FieldSet(
        "profile-edm",
        ("edm.xml",),
        (),
        texture(
            "software gauge, EDM master",
            ("Pa", "µm", 0.46434, 5e-6),
            ("Pq", "µm", 0.55994, 5e-6),
            ("Psk", "1", -0.13265, 5e-6),
            ("Pku", "1", 2.36461, 5e-6),
            ("PSm", "µm", 46.09835, 5e-6),
            ("Pdq", "1", 0.10536, 5e-6),
        ),
        folder="real/reference/profiles",
    ),
)
