"""The path error of the tip along walls, in the cut, in the idle run and of one joint, for the page."""

from __future__ import annotations

import numpy as np

from metro.joint_columns import numbered
from metro.report.numbers import percent
from metro.report.page.curves import HELP
from metro.report.page.packing import THINNED, fitting, gaps, kept, left_out, notes, packed
from metro.report.results import Results
from metro.units import JSON, Array


def path_errors(results: Results, budget: int) -> JSON | None:
    """Return the tip's error along the normal of every wall ([K] figs. 9, 10); None without any.

    The joint that is drawn alone is that with the largest share of the tip's waves, by ``identified``.
    """
    table = results.tables.get("waviness_points")
    if table is None:
        return None
    blocks: JSON = (results.identified.get("arm") or {}).get("waviness") or {}
    curves, sizes, thinned = [], [], False
    for run, rows in table.groupby("run", sort=False):
        by_joint = rows[numbered("strayed{}_um", rows)].to_numpy(float)
        idle: Array = rows[numbered("strayed_idle{}_um", rows)].to_numpy(float).sum(axis=1)
        tip = by_joint.sum(axis=1)
        lines, said = [("tip in the cut", "measured", tip)], str(run)
        if share := blocks.get(str(run), {}).get("joint_share"):
            joint = int(np.argmax(share))
            lines.append((f"joint {joint + 1} alone", "after", by_joint[:, joint]))
            said += f": joint {joint + 1} makes {percent(share[joint])} of the waves"
        lines += [("tip in the idle run", "before", idle)] if np.isfinite(idle).any() else []
        x = rows["x_mm"].to_numpy(float)
        after = gaps(x)
        at = kept([line for _, _, line in lines], after)
        thinned |= len(at) < len(x)
        sizes.append(float(np.ptp(tip)))
        curves.append(
            {
                "key": [str(run)],
                "said": said,
                "x": packed(x[at]),
                "lines": [{"name": name, "look": look, "y": packed(y[at])} for name, look, y in lines],
                "gaps": np.searchsorted(at, after).tolist(),
                "decimals": 1,
                "places": len(x),
            }
        )
    shown = fitting(curves, budget, sizes)
    return {
        "kind": "chart",
        "title": "Path error of the tip along the walls, by the encoders",
        "x": "along the wall (mm)",
        "y": "path error (µm)",
        "unit": "µm",
        "keys": ["run"],
        "first": curves[int(np.argmax(sizes))]["key"],
        "curves": shown,
        "note": notes(left_out(len(shown), len(curves), "runs", "the largest"), THINNED * thinned),
        "help": HELP,
    }
