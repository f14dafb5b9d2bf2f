"""Sound little batches, one for each kind of input, that hold what this kind needs and no more."""

import corpus_signals as signals
import corpus_writers as writers

MANIFEST = """\
format: 1
batch: specimen
title: A sound little batch
source: measured
cell: bench-arm
tool: {diameter_mm: 10, teeth: 4, helix_deg: 30, pitch_deg: [90, 90, 90, 90], overhang_mm: 40}
tool_in_flange_mm: [212.5, 0.0, 279.9]
tool_axes_in_flange: [[0, 0, -1], [0, -1, 0], [-1, 0, 0]]
work: {material: AA6061-T6, size_mm: [60, 40, 20]}
work_in_base: {xyz_mm: [1200, 0, 500], rpy_deg: [0, 0, 0]}
instruments:
  dynamometer: {rate_hz: 1000, reads: work, axes: {x: x, y: y, z: z}, range_n: 5000, noise_n: 1.0}
  robot_log: {period_ms: 4}
  scanner: {spacing_mm: 2, sigma_mm: 0.005, to_work: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}
  profiler: {spacing_mm: 0.1, sigma_mm: 0.0005}
  hammer: {rate_hz: 2048, window: none}
"""
CELL = """\
cell: bench-arm
arm:
  dh: [[0, 90, 500, 250], [90, 0, 0, 610], [-180, -90, 0, 70], [0, 90, 710, 0], [0, -90, 0, 0],
       [0, 0, 215, 0]]
joint_stiffness_nm_rad: [1.0e+6, 1.1e+6, 9.0e+5, 2.0e+5, 1.8e+5, 1.5e+5]
"""
STATIONS = "position,x_mm,y_mm,z_mm,kx_n_um,ky_n_um,kz_n_um\n1,0,0,0,0.93,31,9.3\n2,0,0,-320,0.84,27.5,8.1\n"
COLUMNS = (
    "run,role,condition,replicate,order,operation,spindle_rpm,feed_per_tooth_mm,axial_depth_mm,radial_depth_mm,"
    "direction,cut_length_mm,pose"
)
FEEDS = (0.04, 0.05, 0.06)
LOADS = "pose,point,x_mm,y_mm,z_mm,fx_n,fy_n,fz_n,dx_mm,dy_mm,dz_mm,replicate\n" + "".join(
    f"p1,{point},{x},{y},0,{300 * (k == 0)},{300 * (k == 1)},{300 * (k == 2)},{0.5 if k == 0 else 0.05},"
    f"{0.6 if k == 1 else 0.04},{0.7 if k == 2 else 0.03},1\n"
    for point, x, y in (("a", 10, 10), ("b", 50, 30))
    for k in range(3)
)
MASS = (
    "pose,point,x_mm,y_mm,z_mm,mxx,mxy,mxz,myy,myz,mzz\n"
    "p1,a,10,10,0,650.5,5,380,900,4,280\n"
    "p1,b,50,30,0,640,5,370,890,4,275\n"
)
PRINTED = "table,row,observable,quantity,axis,measured,predicted,unit,printed_error_percent,note\n" + "".join(
    f"7,{i},force,mean force,{axis},{100.5 + i},{99.5 + i},N,1.0,\n" for i, axis in enumerate("xyz", 1)
)
RECORDING = {
    "dynamometer": signals.force,
    "robot_log": signals.robot,
    "idle_log": lambda i: signals.robot(50 + i),
    "path": lambda _: signals.path(),
    "profile": signals.profile,
    "scan": signals.cloud,
    "hammer record": signals.record,
    "FRF": lambda _: signals.frf(),
}
# Kind of input → the columns of runs.csv that its batch fills.
RUN_FILES = {
    "dynamometer": ("dynamometer",),
    "robot_log": ("robot_log", "idle_log"),
    "idle_log": ("robot_log", "idle_log"),
    "path": ("path", "dynamometer"),
    "profile": ("profile", "robot_log"),
    "scan": ("scan",),
    "runs.csv": ("dynamometer",),
    "batch.yaml": ("dynamometer",),
    "batch": ("dynamometer",),
}


def write(folder, kind, form=""):
    """Write the batch of a kind of input, its recordings of that kind in the format ``form``.

    The file that is to be broken is the one that `victim` names.
    """
    folder.mkdir(parents=True)
    (folder / "batch.yaml").write_text(MANIFEST)
    (folder / "cell.yaml").write_text(CELL)
    if kind == "published.csv":
        text = MANIFEST.replace("source: measured", "source: published\ncitation: nobody, nowhere")
        (folder / "batch.yaml").write_text(text)
        (folder / kind).write_text(PRINTED)
    if kind in ("loads.csv", "stations.csv", "cell.yaml"):
        (folder / "loads.csv").write_text(LOADS)
    if kind == "mass.csv":
        (folder / kind).write_text(MASS)
    if kind == "stations.csv":
        (folder / kind).write_text(STATIONS)
        (folder / "cell.yaml").write_text(CELL + "stations: stations.csv\n")
    if kind in ("impacts.csv", "hammer record", "FRF"):
        _impacts(folder, kind, form)
    if kind in ("loads.csv", "mass.csv", "stations.csv", "cell.yaml"):
        _impacts(folder, "FRF", "")  # of which something can be computed
    if kind in RUN_FILES:
        _runs(folder, kind, form)


def victim(kind, form=""):
    """Return the path, relative to the batch, of the file that the cases of a kind break."""
    if kind.endswith((".csv", ".yaml")) or kind == "batch":
        return {"batch": "runs.csv"}.get(kind, kind)
    suffix, _ = writers.FORMATS[kind][form or next(iter(writers.FORMATS[kind]))]
    return f"{'impacts' if kind in ('hammer record', 'FRF') else kind}/r2{suffix}"


def recording(folder, kind, name, number, form=""):
    """Write a recording in a format; return its path relative to the batch."""
    suffix, writer = writers.FORMATS[kind][form or next(iter(writers.FORMATS[kind]))]
    path = folder / f"{name}/r{number}{suffix}"
    path.parent.mkdir(exist_ok=True)
    writer(path, RECORDING[kind](number))
    return str(path.relative_to(folder))


def _runs(folder, kind, form):
    columns = RUN_FILES[kind]
    rows = []
    for i, feed in enumerate(FEEDS, 1):
        named = [recording(folder, c, c, i, form if c == kind else "") for c in columns]
        rows.append(f"r{i},,f{feed},1,{i},side,6000,{feed},1,5,down,60,p1,{','.join(named)}\n")
    (folder / "runs.csv").write_text(f"{COLUMNS},{','.join(columns)}\n{''.join(rows)}")


def _impacts(folder, kind, form):
    which = {"impacts.csv": ("hammer record", "FRF")}.get(kind, (kind, kind))
    rows = []
    for i, one in enumerate(which, 1):
        file = recording(folder, one, "impacts", i, form if one == kind else "")
        word, unit = ("record", "m/s2") if one == "hammer record" else ("frf", "m")
        rows.append(f"tip,1,1x,1x,{i},{word},{file},{unit}\n")
    head = "test,position,reference,response,replicate,kind,file,response_unit\n"
    (folder / "impacts.csv").write_text(head + "".join(rows))
