"""Recordings in every format that the contract names, for a laboratory's file to be broken."""

import hashlib
import struct
import zipfile

import numpy as np
from corpus_matlab import matlab73
from corpus_tdms import segment

AXES = range(1, 7)
X3P_NAMESPACE = "http://www.opengps.eu/2008/ISO5436_2"


def csv(path, table):
    table.to_csv(path, index=False)


def parquet(path, table):
    table.to_parquet(path, index=False)


def dynoware(path, table):
    rows = "\n".join(f"{t:.6f}\t{x:.4f}\t{y:.4f}\t{z:.4f}" for t, x, y, z in table.to_numpy())
    head = "DynoWare\tVersion 2.5.1.2\nPath:\tC:\\Data\\\nSampling rate [Hz]:\t1000\nCycle No:\t1\n"
    path.write_text(f"{head}Time\tFx\tFy\tFz\ns\tN\tN\tN\n{rows}\n")


def named(table):
    """Channels as a recorder names them, with units of their own: name → unit and values."""
    units = {"s": "s", "n": "N", "deg": "deg", "nm": "Nm"}
    for column in table:
        name, _, unit = column.rpartition("_")
        yield (name, units[unit], table[column]) if unit in units else (column, "m/s^2", table[column])


def tdms(path, table):
    """Write two segments, as a recorder that writes while it records."""
    half = len(table) // 2
    parts = [
        {name: (values.to_numpy(), {"unit_string": unit}) for name, unit, values in named(part)}
        for part in (table.iloc[:half], table.iloc[half:])
    ]
    path.write_bytes(b"".join(segment(part) for part in parts))


def mat(path, table):
    from scipy.io import savemat

    savemat(path, {name: table[name].to_numpy() for name in table}, do_compression=True)


def mat_hdf5(path, table):
    units = {name: unit for name, unit, _ in named(table)}
    matlab73(path, {"record": {name: each.to_numpy() for name, _, each in named(table)}, "units": units})


def _axes(tag, values):
    return f"<{tag} " + " ".join(f'A{i}="{value:.6f}"' for i, value in zip(AXES, values, strict=True)) + "/>"


def rsi(path, table):
    telegrams = []
    for row in table.to_dict("records"):
        parts = [
            _axes(tag, [row[name.format(i)] for i in AXES])
            for tag, name in (("AIPos", "q{}_deg"), ("ASPos", "q{}_set_deg"), ("GearTorque", "tau{}_nm"))
        ]
        ipoc = round(row["t_s"] * 1000)
        telegrams.append(f'<Rob Type="KUKA">{"".join(parts)}<Delay D="0"/><IPOC>{ipoc}</IPOC></Rob>')
    path.write_text("\n".join(telegrams) + "\n")


def rosbag(path, table):
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    state, name = store.types["sensor_msgs/msg/JointState"], "sensor_msgs/msg/JointState"
    folder = path.parent / f"{path.name}.bag"
    plugin = StoragePlugin.MCAP if path.suffix == ".mcap" else StoragePlugin.SQLITE3
    joints, none = [f"joint_a{i}" for i in AXES], np.array([])
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        for topic, angle in (("/joint_states", "q{}_deg"), ("/joint_setpoints", "q{}_set_deg")):
            connection = writer.add_connection(topic, name, typestore=store)
            for row in table.to_dict("records"):
                ns = round(row["t_s"] * 1e9)
                stamp = store.types["builtin_interfaces/msg/Time"](ns // 10**9, ns % 10**9)
                header = store.types["std_msgs/msg/Header"](stamp, "")
                position = np.radians([row[angle.format(i)] for i in AXES])
                effort = np.array([row[f"tau{i}_nm"] for i in AXES]) if angle == "q{}_deg" else none
                message = state(header, joints, position, none, effort)
                writer.write(connection, ns, store.serialize_cdr(message, name))
    next(file for file in folder.iterdir() if file.suffix != ".yaml").rename(path)
    (folder / "metadata.yaml").unlink()
    folder.rmdir()


def npz(path, table):
    np.savez(path, freq_hz=table["frequency_hz"], frf=table["real"] + 1j * table["imag"])


def uff(path, table, *, binary=True):
    from metro.formats.uff import FRF, Function
    from metro.formats.uff_writer import universal_file

    values = (table["real"] + 1j * table["imag"]).to_numpy()
    one = Function(FRF, "1x", "1x", "m", table["frequency_hz"].to_numpy(), values)
    path.write_bytes(universal_file([one], binary=binary))


def uff_text(path, table):
    uff(path, table, binary=False)


def _lines(table):
    return "".join(f"{x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in table.to_numpy())


def xyz(path, table):
    path.write_text(_lines(table))


def pts(path, table):
    path.write_text(f"{len(table)}\n{_lines(table)}")


def ply(path, table):
    head = f"ply\nformat ascii 1.0\nelement vertex {len(table)}\n"
    names = "".join(f"property float {name}\n" for name in "xyz")
    path.write_text(f"{head}{names}end_header\n{_lines(table)}")


def ply_binary(path, table):
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(table)}\n"
    names = "".join(f"property double {name}\n" for name in "xyz")
    path.write_bytes(f"{head}{names}end_header\n".encode() + table.to_numpy().astype("<f8").tobytes())


def _pcd_head(table, encoding, width):
    n = len(table)
    return (
        f"# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE {width} {width} {width}\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {n}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA {encoding}\n"
    )


def pcd(path, table):
    path.write_text(_pcd_head(table, "ascii", 8) + _lines(table))


def pcd_binary(path, table):
    path.write_bytes(_pcd_head(table, "binary", 8).encode() + table.to_numpy().astype("<f8").tobytes())


def e57(path, table):
    import pye57

    points = table.to_numpy() * 1e-3
    with pye57.E57(str(path), mode="w") as file:
        file.write_scan_raw({f"cartesian{a}": points[:, i].copy() for i, a in enumerate("XYZ")})


def _facets(table):
    points = table.to_numpy()
    return np.stack([points[:-2], points[1:-1], points[2:]], axis=1)


def stl(path, table):
    facets = _facets(table)
    kind = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
    body = np.zeros(len(facets), kind)
    body["vertices"] = facets
    path.write_bytes(b"made by hand".ljust(80) + struct.pack("<I", len(facets)) + body.tobytes())


def stl_text(path, table):
    facets = "".join(
        "facet normal 0 0 1\nouter loop\n"
        + "".join(f"vertex {x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in facet)
        + "endloop\nendfacet\n"
        for facet in _facets(table)
    )
    path.write_text(f"solid face\n{facets}endsolid face\n")


def x3p(path, table):
    heights = table["z_mm"].to_numpy() * 1e-3
    data = heights.astype("<f8").tobytes()
    step = float(np.diff(table["x_mm"]).mean() * 1e-3)
    x = f"<AxisType>I</AxisType><DataType>D</DataType><Increment>{step!r}</Increment><Offset>0</Offset>"
    z = "<AxisType>A</AxisType><DataType>D</DataType><Increment>1</Increment><Offset>0</Offset>"
    size = f"<SizeX>{len(heights)}</SizeX><SizeY>1</SizeY><SizeZ>1</SizeZ>"
    text = (
        f'<?xml version="1.0" encoding="UTF-8"?><p:ISO5436_2 xmlns:p="{X3P_NAMESPACE}"><Record1>'
        f"<Revision>ISO5436 - 2000</Revision><FeatureType>PRF</FeatureType>"
        f"<Axes><CX>{x}</CX><CY>{x}</CY><CZ>{z}</CZ></Axes></Record1>"
        f"<Record3><MatrixDimension>{size}</MatrixDimension>"
        f"<DataLink><PointDataLink>bindata/data.bin</PointDataLink><MD5ChecksumPointData>"
        f"{hashlib.md5(data).hexdigest()}</MD5ChecksumPointData></DataLink></Record3>"
        "<Record4><ChecksumFile>md5checksum.hex</ChecksumFile></Record4></p:ISO5436_2>"
    ).encode()
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("main.xml", text)
        archive.writestr("bindata/data.bin", data)
        archive.writestr("md5checksum.hex", f"{hashlib.md5(text).hexdigest()} *main.xml\n")


CHANNELS = {"TDMS": (".tdms", tdms), "MAT v7": (".mat", mat), "MAT v7.3": (".mat", mat_hdf5)}
# Kind of recording → format → suffix and writer; the first is the one that batches have unless asked.
FORMATS = {
    "dynamometer": {
        "CSV": (".csv", csv),
        "Parquet": (".parquet", parquet),
        "DynoWare": (".txt", dynoware),
        **CHANNELS,
    },
    "robot_log": {
        "CSV": (".csv", csv),
        "Parquet": (".parquet", parquet),
        "RSI": (".rsi", rsi),
        "MCAP": (".mcap", rosbag),
        "ROS db3": (".db3", rosbag),
        **CHANNELS,
    },
    "idle_log": {"CSV": (".csv", csv), "RSI": (".rsi", rsi)},
    "path": {"CSV": (".csv", csv), "Parquet": (".parquet", parquet)},
    "profile": {"CSV": (".csv", csv), "Parquet": (".parquet", parquet), "X3P": (".x3p", x3p)},
    "scan": {
        "XYZ": (".xyz", xyz),
        "CSV": (".csv", csv),
        "Parquet": (".parquet", parquet),
        "PTS": (".pts", pts),
        "PLY": (".ply", ply),
        "PLY binary": (".ply", ply_binary),
        "PCD": (".pcd", pcd),
        "PCD binary": (".pcd", pcd_binary),
        "E57": (".e57", e57),
        "STL": (".stl", stl_text),
        "STL binary": (".stl", stl),
    },
    "hammer record": {"CSV": (".csv", csv), "Parquet": (".parquet", parquet), **CHANNELS},
    "FRF": {
        "CSV": (".csv", csv),
        "Parquet": (".parquet", parquet),
        "npz": (".npz", npz),
        "UFF 58": (".uff", uff_text),
        "UFF 58b": (".uff", uff),
    },
}
