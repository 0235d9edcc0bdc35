"""Experiments A and B as they are: the runtime's model in its steps against the full model in much finer ones, 12 h."""

from __future__ import annotations

import numpy as np

from benchmarks.five_axis import FOLDER, compact, full, machine, rich
from twin.build.certificate import Certificate
from twin.build.pipeline import VERIFY_SEED, BuildOptions, certificate
from twin.build.stepper import CoupledStepper, sensor_temperatures, tcp_at_poses
from twin.build.volumetric import volumetric_shares
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.progress import bar
from twin.rom.drive import evaluate, split

SUBSTEPS = 1  # with which `twin build` certifies the machine
# Steps of the full model in a minute. In experiment A, 8 and 16 of the reduced one differ by 0.0001 K.
FINER = 4


def main() -> None:
    known = certificate(
        machine(), rich(), compact(), full().thermal, BuildOptions(), VERIFY_SEED, progress=bar
    )  # as `twin verify` makes it
    for name in ("experiment_a", "experiment_b"):
        _case(name, known)


def _case(name: str, known: Certificate) -> None:
    reference, candidate = full().thermal, compact()
    run = read_run(FOLDER / "runs" / name)
    load = reference.load_model
    drive = evaluate(load, run.loads.time, signal_values(run, load.signals), 60.0)
    start = run.initial_temperature if run.initial_temperature is not None else float(drive.environment[0, 0])
    a, b = CoupledStepper(reference), CoupledStepper(candidate)
    T, T_error, u, u_error, balance = [], [], [], [], 0.0
    every_minute = (made for made in a.run(split(drive, FINER), a.uniform(start)) if (made[0] + 1) % FINER == 0)
    steps = zip(every_minute, b.run(drive, b.uniform(start), SUBSTEPS), strict=True)
    with bar(f"full model, {name}", drive.n_steps) as advance:
        for (_, xa, heat), (_, xb, _) in steps:
            balance = max(balance, heat.balance_error)
            T.append(sensor_temperatures(reference, xa))
            u.append(tcp_at_poses(reference, xa))
            T_error.append(np.abs(T[-1] - sensor_temperatures(candidate, xb)).max())
            u_error.append(np.abs(u[-1] - tcp_at_poses(candidate, xb)).max())
            advance("")
    rise, tcp = np.ptp(np.array(T), axis=0).max(), 1e6 * np.abs(u).max(axis=(0, 1))
    print(f"   {name}: largest rise {rise:.1f} K, TCP error {tcp[0]:.1f}, {tcp[1]:.1f}, {tcp[2]:.1f} um in X, Y, Z")
    print(f"   largest error against it: {max(T_error):.5f} K at a sensor, {1e6 * max(u_error):.4f} um at a pose")
    # the certificate's case, scaled to this run as its scenarios were to the case
    T_certified = known.max_temperature_error * rise / known.case_temperature
    u_certified = known.max_displacement_error * max(tcp) / (1e6 * known.case_displacement)
    print(f"   certified for {rise:.1f} K and {max(tcp):.1f} um: {T_certified:.4f} K, {1e6 * u_certified:.3f} um")
    print(f"   heat balance of the full model closes to {balance:.1e} of the throughput in every step")
    for hour in (1, 4, 5, 8, 12):
        s = volumetric_shares(reference.poses, u[60 * hour - 1])
        print(
            f"   volumetric error after {hour:2d} h: {s.shift:.0%} shift, {s.linear:.0%} linear, {s.higher:.1%} higher"
        )
