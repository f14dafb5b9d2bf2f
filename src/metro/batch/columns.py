"""The columns of the contract's tables, and the values that each may hold."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from metro.batch.ranges import number_in_words, range_of
from metro.joint_columns import MOVED, SHIFTS, TORQUES, TURNS

Kind = Literal["text", "number", "integer", "file", "time"]
# Columns of runs.csv that name a file of that run alone.
OWN_TO_A_RUN = ("dynamometer", "robot_log", "joint_log", "scan", "profile", "slopes", "poses")


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes
    ----------
    name : as in the header.
    kind : what a cell holds; a file is a path relative to the batch folder, a time is ISO 8601.
    required : the column must be there, and filled in every row.
    quantity : of a number, the name of its range (``schemas/ranges.json``).
    choices : the values that are allowed, where there are few.
    pattern, words : regular expression of a text, and what it asks for.
    longest : most characters of a text.
    """

    name: str
    kind: Kind = "text"
    required: bool = False
    quantity: str = ""
    choices: tuple[str, ...] = ()
    pattern: str = ""
    words: str = ""
    longest: int = 200

    @property
    def rule(self) -> Mapping[str, Any]:
        """Range of a number, as JSON Schema; empty for other cells."""
        return range_of(self.quantity) if self.quantity else {}

    @property
    def expected(self) -> str:
        """What a cell should hold, in words."""
        if self.choices:
            return " or ".join(self.choices) + ("" if self.required else ", or blank")
        if self.quantity:
            return number_in_words(self.rule)
        return self.words or {"time": "a time as ISO 8601"}.get(self.kind, self.kind)

    @property
    def numeric(self) -> bool:
        """Whether the column holds numbers (blank: NaN) rather than text (blank: "")."""
        return self.kind in {"number", "integer"}


def _numbers(quantity: str, *names: str, required: bool = False) -> tuple[Column, ...]:
    """Return columns of numbers of one range."""
    return tuple(Column(name, "number", required, quantity) for name in names)


_REPLICATE = Column("replicate", "integer", quantity="replicate")
_POINT_AXIS = r"[A-Za-z0-9_.]+[+-]?[xyz]"

_POSITIONS = (*_numbers("joint_deg", *TURNS), *_numbers("place_mm", *SHIFTS))
_MOVED = tuple(Column(name, "number", quantity=re.sub(r"\d", "", name, count=1)) for name in MOVED)

RUNS = (
    Column("run", required=True),
    Column("role", choices=("identify", "validate")),
    Column("condition"),
    _REPLICATE,
    Column("order", "integer", quantity="order"),
    Column("operation", choices=("slot", "side", "face", "helical")),
    *_numbers("spindle_rpm", "spindle_rpm"),
    *_numbers("feed_per_tooth_mm", "feed_per_tooth_mm"),
    *_numbers("depth_mm", "axial_depth_mm", "radial_depth_mm"),
    Column("direction", choices=("up", "down", "slot")),
    *_numbers("orbit_rpm", "orbit_rpm"),
    *_numbers("orientation_deg", "feed_direction_deg"),
    *_numbers("cut_length_mm", "cut_length_mm"),
    Column("wrist"),
    Column("location"),
    Column("orientation"),
    Column("pose"),
    Column("dynamometer", "file"),
    Column("robot_log", "file"),
    Column("idle_log", "file"),
    Column("joint_log", "file"),
    Column("loaded", choices=("yes", "no")),
    Column("path", "file"),
    Column("scan", "file"),
    Column("profile", "file"),
    Column("slopes", "file"),
    Column("poses", "file"),
    Column("targets", "file"),
    Column("stable", choices=("yes", "no")),
    Column("started_at", "time"),
    *_numbers("return_s", "return_s"),
    Column("plate"),
)

IMPACTS = (
    Column("test"),
    Column("position"),
    Column("reference", pattern=_POINT_AXIS, words="a point and an axis, as 1x"),
    Column("response", pattern=_POINT_AXIS, words="a point and an axis, as 7z"),
    _REPLICATE,
    Column("kind", choices=("record", "frf")),
    Column("file", "file", required=True),
    Column("response_unit", choices=("m/s2", "m/s", "m", "g")),
    *_numbers("distance_mm", "distance_mm"),
)

LOADS = (
    Column("pose"),
    Column("point"),
    *_POSITIONS,
    *_numbers("place_mm", "x_mm", "y_mm", "z_mm"),
    *_numbers("force_n", "fx_n", "fy_n", "fz_n", required=True),
    *_numbers("displacement_mm", "dx_mm", "dy_mm", "dz_mm"),
    _REPLICATE,
    *_numbers("sigma_mm", "sigma_mm"),
)

MASS = (
    Column("pose"),
    Column("point"),
    *_numbers("place_mm", "x_mm", "y_mm", "z_mm"),
    *_numbers("mass_kg", "mxx", required=True),
    *_numbers("mass_between_kg", "mxy", "mxz", required=True),
    *_numbers("mass_kg", "myy", required=True),
    *_numbers("mass_between_kg", "myz", required=True),
    *_numbers("mass_kg", "mzz", required=True),
    *_POSITIONS,
)

PUBLISHED = (
    Column("table", required=True),
    Column("row", required=True),
    Column("observable"),
    Column("quantity", required=True),
    Column("axis"),
    *_numbers("printed", "measured", "predicted"),
    Column("unit", required=True),
    *_numbers("printed_error_percent", "printed_error_percent"),
    Column("note", longest=5000),
)

TOUCHES = (
    Column("touched", required=True),
    *_numbers("place_mm", "x_mm", "y_mm", "z_mm", required=True),
    *_numbers("direction_cosine", "q1", "q2", "q3", "q4"),
    *_numbers("orientation_deg", "rx_deg", "ry_deg", "rz_deg"),
    *_numbers("sigma_mm", "sigma_mm"),
)

PAYLOAD = (
    Column("loaded", required=True, choices=("yes", "no")),
    *_POSITIONS,
    *_numbers("torque_nm", *TORQUES),
    *_MOVED,
)

# Force along the first axis over deflection along the second; one of a pair that is blank is as the other.
CROSS_STIFFNESS = ("kxy_n_um", "kyx_n_um", "kxz_n_um", "kzx_n_um", "kyz_n_um", "kzy_n_um")
STATIONS = (
    Column("position", required=True),
    *_numbers("place_mm", "x_mm", "y_mm", "z_mm", required=True),
    *_numbers("stiffness_n_um", "kx_n_um", "ky_n_um", "kz_n_um", required=True),
    *_numbers("cross_stiffness_n_um", *CROSS_STIFFNESS),
)

# Table → its columns; the first one or two label a row in messages.
TABLES: dict[str, tuple[Column, ...]] = {
    "runs": RUNS,
    "impacts": IMPACTS,
    "loads": LOADS,
    "mass": MASS,
    "touches": TOUCHES,
    "payload": PAYLOAD,
    "published": PUBLISHED,
    "stations": STATIONS,
}
