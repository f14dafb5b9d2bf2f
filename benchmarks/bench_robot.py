"""Seconds for a ten-minute robot log: aligned, filtered, smoothed, turned into force and deformation.

50 000 samples of six joints in the cut and as many in the idle run, 12 ms apart. Target: 2 s together on one
core. Peer: filterpy's filter and RTS smoother, sample by sample in Python, on a tenth of the bins of one
joint; the smoother here is a cosine transform. Run: ``pytest benchmarks/bench_robot.py``.
"""

import time

import numpy as np
import pytest

from metro.robot.kinematics import arm_of_cell
from metro.robot.sensorless import mean_force, noise_of_bins, observability, smoothed_torque, tip_force
from metro.robot.statics import joint_contributions, tip_jacobian
from metro.signals import align, kalman
from metro.signals.path_match import match

DH = [[0, 90, 500, 250], [90, 0, 0, 610], [-180, -90, 0, 70], [0, 90, 710, 0], [0, -90, 0, 0], [0, 0, 215, 0]]
ARM = arm_of_cell({"arm": {"dh": DH}}, {"tool_in_flange_mm": [212.5, 0.0, 279.91]})
HOME = np.array([0.1, -0.9, 0.2, 0.3, 0.8, 0.2])
SOFT = 1e-6 * np.array([0.8, 0.5, 1.1, 4.0, 5.0, 6.0])
FORCE = np.array([80.0, -170.0, -35.0])
COUNT, PERIOD, TARGET = 50_000, 0.012, 2.0


def logs():
    """Joint angles, times and torques of a cut and an idle run that started apart: ten passes of a metre."""
    rng = np.random.default_rng(1)

    def run(phase):
        share = (np.arange(COUNT) + phase) / COUNT
        swing = 0.35 * np.sin(10 * np.pi * share)
        return HOME + np.outer(share, [0.0, 0.3, -0.2, 0.4, 0.2, -0.5]) + np.outer(swing, np.eye(6)[0])

    cut, idle = run(0.0), run(0.37)
    friction = [20 * np.sin(q) + rng.normal(0, 3.0, q.shape) for q in (cut, idle)]
    load = -np.einsum("mai,a->mi", tip_jacobian(ARM, cut), FORCE)
    time_of = PERIOD * np.arange(COUNT)
    return (cut, time_of, friction[0] + load), (idle, time_of, friction[1])


def whole(cut, idle):
    """From the logs to force and deformation along the path."""
    (q, stamps, torque), (q_idle, stamps_idle, torque_idle) = cut, idle
    tip, tip_idle = ARM.tip(q), ARM.tip(q_idle)
    moves, moves_idle = align.moving(tip), align.moving(tip_idle)
    tip, tip_idle = tip[moves], tip_idle[moves_idle]
    alike = match(tip, stamps[moves], tip_idle, stamps_idle[moves_idle])
    assert alike.refusal is None
    places = [align.along_path(one, tip) for one in (tip, tip_idle)]
    step = float(np.median(np.diff(places[0])))
    width = max(1e-3, 3 * step)
    channels = np.column_stack([torque, q])[moves], np.column_stack([torque_idle, q_idle])[moves_idle]
    pair = align.align(places[0], channels[0], places[1], channels[1], width)
    noise = noise_of_bins(torque[moves], torque_idle[moves_idle], (width / step, width / step))
    smoothed = smoothed_torque(pair.first[:, :6] - pair.second[:, :6], noise)
    joints = pair.first[:, 6:]
    index = observability(pair.first[:, :6] - pair.second[:, :6], pair.second[:, :6])
    found = tip_force(smoothed.level, smoothed.variance, tip_jacobian(ARM, joints), index, least=0.0)
    mean, covariance = mean_force(found, smoothed, np.full(len(pair.s), True))
    deformation = joint_contributions(ARM, joints, found.force) @ SOFT
    return len(pair.s), mean, covariance, deformation


def test_ten_minutes_of_log(benchmark):
    cut, idle = logs()
    bins, mean, covariance, deformation = benchmark.pedantic(whole, (cut, idle), rounds=5, warmup_rounds=1)
    benchmark.extra_info["bins"] = bins
    assert deformation.shape == (bins, 3)
    assert np.all(np.abs(mean - FORCE) < 4 * np.sqrt(np.diag(covariance)))
    assert benchmark.stats["min"] < TARGET


def test_the_smoother_against_filterpys(benchmark):
    from filterpy.kalman import KalmanFilter

    rng = np.random.default_rng(2)
    signal = np.cumsum(rng.normal(0, 0.3, (16_000, 6)), axis=0) + rng.normal(0, 1.0, (16_000, 6))
    one, few = np.ones(6), 1600
    level, _ = benchmark(kalman.smooth, signal, one, 0.09 * one)
    start = time.perf_counter()
    peer = KalmanFilter(dim_x=1, dim_z=1)
    peer.F = peer.H = peer.R = np.eye(1)
    peer.Q, peer.x, peer.P = np.array([[0.09]]), signal[:1, :1].copy(), np.eye(1)
    mean, spread, _, _ = peer.batch_filter(signal[1:few, 0])
    mean, _, _, _ = peer.rts_smoother(mean, spread)
    seconds = (time.perf_counter() - start) * 6 * len(signal) / few
    benchmark.extra_info["ratio_to_filterpy"] = seconds / benchmark.stats["min"]
    # away from the end that the peer has not seen
    assert mean[100:1500, 0, 0] == pytest.approx(level[101:1501, 0], abs=1e-6)
