"""Areal parameters: the S parameters of scans that are rasters, with intervals, and how each was made."""

from __future__ import annotations

from metro.report.content import Bullets, Facts, Item, Section, Table
from metro.report.numbers import listing, quantity
from metro.report.results import Results

LONGEST = 24
TABLES = (("a", "q", "p", "v", "z"), ("sk", "ku", "dq", "dr", "al", "tr"))
IN_UM = ("a", "q", "p", "v", "z", "al")
SOURCES = {"place": "the scatter over the surface", "noise": "the noise of the scanner"}


def areal(results: Results) -> Section | None:
    """Write the S parameters of all rasters; None for a batch without any."""
    blocks = results.identified.get("areal")
    if not blocks:
        return None
    runs = {run: block for run, block in blocks.items() if run != "not_identified"}
    shown = dict(list(runs.items())[:LONGEST])
    items: list[Item] = []
    for number, names in enumerate(TABLES if runs else ()):
        header = ["run", *(f"S{name}{' (µm)' if name in IN_UM else ''}" for name in names)]
        rows = [
            [run, *(quantity(block[name], with_unit=False) if name in block else "–" for name in names)]
            for run, block in shown.items()
        ]
        made = listing(list(dict.fromkeys(str(block["made"]) for block in runs.values())))
        cells = [block[name] for block in runs.values() for name in names if name in block]
        sources = [said for name, said in SOURCES.items() if any(name in cell["sources"] for cell in cells)]
        caption = (
            "Shape of the distribution, slopes and correlation of the same surfaces."
            if number
            else f"Areal parameters by ISO 25178-2 of the S-F surface: {made}."
        )
        caption += f" The 95 % intervals cover {listing(sources)}." if sources else ""
        caption += f" The first {LONGEST} of {len(runs)} scans." if len(runs) > LONGEST else ""
        widths, numeric = [0.6, *([1.0] * len(names))], list(range(1, len(header)))
        items.append(Table(header, rows, caption, widths, numeric=numeric, small=True))
    alike: dict[str, list[str]] = {}
    for run, block in runs.items():
        for remark in block["remarks"]:
            alike.setdefault(remark, []).append(run)
    said = [f"{listing(names)}: {text}." for text, names in alike.items()]
    said += [f"{run}: {reason}." for run, reason in (blocks.get("not_identified") or {}).items()]
    return Section("Areal parameters", [*items, *([Bullets(said)] if said else [])])


def first_areal(results: Results) -> list[Item]:
    """Give Sa, Sq and Sz of the only raster."""
    blocks = results.identified.get("areal") or {}
    runs = {run: block for run, block in blocks.items() if run != "not_identified"}
    if len(runs) != 1:
        return []
    ((run, block),) = runs.items()
    remark = f"S-filter {block['nesting_index_mm']:.3g} mm"
    return [Facts([(f"S{name} of {run}", quantity(block[name]), remark) for name in ("a", "q", "z")])]
