"""The columns of the contract's tables: what may stand in each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Kind = Literal["text", "number", "integer", "file", "time"]


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Attributes
    ----------
    name : as in the header.
    kind : what a cell holds; a file is a path relative to the batch folder, a time is ISO 8601.
    required : the column must be there, and filled in every row.
    above, at_least : bounds of a number.
    choices : the values that are allowed, where there are few.
    pattern, words : regular expression of a text, and what it asks for.
    """

    name: str
    kind: Kind = "text"
    required: bool = False
    above: float | None = None
    at_least: float | None = None
    choices: tuple[str, ...] = ()
    pattern: str = ""
    words: str = ""

    @property
    def expected(self) -> str:
        """What a cell should hold, in words."""
        if self.choices:
            return " or ".join(self.choices) + ("" if self.required else ", or blank")
        words = self.words or {
            "number": "a number",
            "integer": "an integer",
            "time": "a time as ISO 8601",
        }.get(self.kind, self.kind)
        bounds = [
            f" {sign} {bound:g}"
            for sign, bound in ((">", self.above), ("≥", self.at_least))
            if bound is not None
        ]
        return words + "".join(bounds)

    @property
    def numeric(self) -> bool:
        """Whether the column holds numbers (blank: NaN) rather than text (blank: "")."""
        return self.kind in {"number", "integer"}


def _numbers(*names: str, required: bool = False) -> tuple[Column, ...]:
    """Return columns of numbers without bounds."""
    return tuple(Column(name, "number", required) for name in names)


def _positive(*names: str, required: bool = False) -> tuple[Column, ...]:
    """Return columns of numbers above zero."""
    return tuple(Column(name, "number", required, above=0) for name in names)


_REPLICATE = Column("replicate", "integer", at_least=1)
_POINT_AXIS = r"[A-Za-z0-9_.]+[+-]?[xyz]"

RUNS = (
    Column("run", required=True),
    Column("role", choices=("identify", "validate")),
    Column("condition"),
    _REPLICATE,
    Column("order", "integer", at_least=0),
    Column("operation", choices=("slot", "side", "face", "helical")),
    *_positive("spindle_rpm", "feed_per_tooth_mm", "axial_depth_mm", "radial_depth_mm"),
    Column("direction", choices=("up", "down", "slot")),
    *_numbers("orbit_rpm", "feed_direction_deg"),
    Column("cut_length_mm", "number", at_least=0),
    Column("wrist"),
    Column("location"),
    Column("orientation"),
    Column("pose"),
    Column("dynamometer", "file"),
    Column("robot_log", "file"),
    Column("idle_log", "file"),
    Column("path", "file"),
    Column("scan", "file"),
    Column("profile", "file"),
    Column("stable", choices=("yes", "no")),
    Column("started_at", "time"),
    Column("return_s", "number", at_least=0),
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
)

LOADS = (
    Column("pose"),
    Column("point"),
    *_numbers(*(f"q{i}_deg" for i in range(1, 7)), "x_mm", "y_mm", "z_mm"),
    *_numbers("fx_n", "fy_n", "fz_n", required=True),
    *_numbers("dx_mm", "dy_mm", "dz_mm"),
    _REPLICATE,
    *_positive("sigma_mm"),
)

MASS = (
    Column("pose"),
    Column("point"),
    *_numbers("x_mm", "y_mm", "z_mm"),
    *_positive("mxx", required=True),
    *_numbers("mxy", "mxz", required=True),
    *_positive("myy", required=True),
    *_numbers("myz", required=True),
    *_positive("mzz", required=True),
)

PUBLISHED = (
    Column("table", required=True),
    Column("row", required=True),
    Column("observable"),
    Column("quantity", required=True),
    Column("axis"),
    *_numbers("measured", "predicted"),
    Column("unit", required=True),
    Column("printed_error_percent", "number"),
    Column("note"),
)

STATIONS = (
    Column("position", required=True),
    *_numbers("x_mm", "y_mm", "z_mm", required=True),
    *_positive("kx_n_um", "ky_n_um", "kz_n_um", required=True),
)

# Table → its columns; the first one or two label a row in messages.
TABLES: dict[str, tuple[Column, ...]] = {
    "runs": RUNS,
    "impacts": IMPACTS,
    "loads": LOADS,
    "mass": MASS,
    "published": PUBLISHED,
    "stations": STATIONS,
}
