"""Experiment A as it is (38 um, 10 K): the runtime's model against the full model at every minute of 12 h."""

from __future__ import annotations

import numpy as np

from benchmarks.five_axis import FOLDER, compact, full
from twin.build.stepper import CoupledStepper, sensor_temperatures, tcp_at_poses
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.progress import bar
from twin.rom.drive import evaluate


def main() -> None:
    reference, candidate = full().thermal, compact()
    run = read_run(FOLDER / "runs" / "experiment_a")
    load = reference.load_model
    drive = evaluate(load, run.loads.time, signal_values(run, load.signals), 60.0)
    start = run.initial_temperature if run.initial_temperature is not None else float(drive.environment[0, 0])
    a, b = CoupledStepper(reference), CoupledStepper(candidate)
    T, T_error, u, u_error, balance = [], [], [], [], 0.0
    steps = zip(a.run(drive, a.uniform(start), 4), b.run(drive, b.uniform(start), 4), strict=True)
    with bar("full model, 12 h", drive.n_steps) as advance:
        for (_, xa, heat), (_, xb, _) in steps:
            balance = max(balance, heat.balance_error)
            T.append(sensor_temperatures(reference, xa))
            u.append(tcp_at_poses(reference, xa))
            T_error.append(np.abs(T[-1] - sensor_temperatures(candidate, xb)).max())
            u_error.append(np.abs(u[-1] - tcp_at_poses(candidate, xb)).max())
            advance("")
    rise, tcp = np.ptp(np.array(T), axis=0).max(), np.abs(u).max()
    print(f"   largest rise {rise:.1f} K, largest TCP error {1e6 * tcp:.1f} um")
    print(f"   largest error against it: {max(T_error):.4f} K at a sensor, {1e6 * max(u_error):.3f} um at a pose")
    print(f"   heat balance of the full model closes to {balance:.1e} of the throughput in every step")
