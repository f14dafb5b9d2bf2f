"""One run of the bundled side-milling batch, its robot logs as RSI telegrams and ROS 2 bags: one table."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from metro.batch.processed import read_table
from metro.stages.ingest import ingest

ROOT = Path(__file__).parents[2]
BATCH = ROOT / "data/raw/kr160-side"
AXES = range(1, 7)
ACTUAL, COMMANDED, TORQUE = (
    [name.format(i) for i in AXES] for name in ("q{}_deg", "q{}_set_deg", "tau{}_nm")
)
DIGITS = 5e-7  # telegrams are written with six decimals


def write_rsi(table, path):
    """Write telegrams, some of them late, some twice, some followed by a torn copy."""

    def telegram(row):
        axes = [("AIPos", ACTUAL), ("ASPos", COMMANDED), ("GearTorque", TORQUE)]
        elements = [
            f"<{tag} " + " ".join(f'A{i}="{row[n]:.6f}"' for i, n in zip(AXES, names, strict=True)) + "/>"
            for tag, names in axes
        ]
        return f'<Rob Type="KUKA">{"".join(elements)}<IPOC>{round(1e3 * row["t_s"])}</IPOC></Rob>\n'

    texts = [telegram(row) for row in table.to_dict("records")]
    for at in range(5, len(texts) - 12, 50):
        texts[at], texts[at + 1] = texts[at + 1], texts[at]
        texts[at + 10] += texts[at + 10] + texts[at + 10][:200]
    path.write_text("".join(texts))


def write_bag(table, path):
    types = get_typestore(Stores.ROS2_HUMBLE)
    kind = "sensor_msgs/msg/JointState"
    names = [f"joint_{i}" for i in AXES]
    with Writer(path.parent / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics = [
            writer.add_connection(t, kind, typestore=types) for t in ("/joint_states", "/joint_commands")
        ]
        for row in table.to_dict("records"):
            ns = round(1e9 * row["t_s"])
            stamp = types.types["builtin_interfaces/msg/Time"](*divmod(ns, 10**9))
            header = types.types["std_msgs/msg/Header"](stamp, "")
            torque = np.array([row[name] for name in TORQUE])
            for topic, angles, effort in zip(
                topics, (ACTUAL, COMMANDED), (torque, np.array([])), strict=True
            ):
                position = np.radians([row[name] for name in angles])
                message = types.types[kind](header, names, position, np.array([]), effort)
                writer.write(topic, ns, types.serialize_cdr(message, kind))
    shutil.move(next((path.parent / "bag").glob("*.mcap")), path)
    shutil.rmtree(path.parent / "bag")


def one_run(folder, suffix, write):
    """Copy the first run of the batch, its two robot logs written anew."""
    for name in ("batch.yaml", "cell.yaml", "loads.csv"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(BATCH / name, folder / name)
    runs = pd.read_csv(BATCH / "runs.csv", dtype=str).iloc[:1]
    for column in ("robot_log", "idle_log"):
        source = BATCH / runs.loc[0, column]
        runs.loc[0, column] = f"{column}{suffix}"
        write(pd.read_parquet(source).astype(float), folder / f"{column}{suffix}")
    runs.drop(columns=["dynamometer", "profile"]).to_csv(folder / "runs.csv", index=False)
    out = folder.parents[1] / "processed"
    ingest(folder, ROOT / "config/cells", out, {}, "")
    return read_table(out / "robot.parquet"), read_table(out / "qc.parquet")


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    def with_suffix(suffix, write):
        return one_run(tmp_path_factory.mktemp("of") / "raw/kr160-side", suffix, write)

    return {
        ".parquet": with_suffix(".parquet", lambda table, path: table.to_parquet(path)),
        ".rsi": with_suffix(".rsi", write_rsi),
        ".mcap": with_suffix(".mcap", write_bag),
    }


@pytest.mark.parametrize(("suffix", "digits"), [(".rsi", DIGITS), (".mcap", 1e-9)])
def test_ingest_gives_the_same_table_to_the_digits_of_the_format(tables, suffix, digits):
    expected, found = tables[".parquet"][0], tables[suffix][0]
    assert len(expected) > 1900
    assert list(found["log"]) == list(expected["log"])
    numbers = [name for name in expected if name not in ("run", "log")]
    np.testing.assert_allclose(found[numbers], expected[numbers], rtol=0, atol=1.01 * digits)


def test_without_telegrams_the_gaps_stay_and_the_quality_table_counts_them(tmp_path):
    def thinned(table, path):
        write_rsi(table.drop(index=[100, 101, 300]), path)

    robot, quality = one_run(tmp_path / "raw/kr160-side", ".rsi", thinned)
    cut = robot[robot["log"] == "cut"]
    assert np.sort(np.diff(cut["t_s"]))[-2:] == pytest.approx([0.024, 0.036])
    gaps = quality[quality["check"] == "gaps"]
    assert list(gaps["value"]) == [2.0, 2.0]
    assert not gaps["ok"].any()
