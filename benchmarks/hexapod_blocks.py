"""8 h of the hexapod's records of 10 ms, from blocks of 10 s to temperatures and TCP errors (paper 001, 16.3.6).

Six struts x (position, speed, current) and the ambient temperature. Every record finds the segment below its nut; heat
is the mean over its step of a minute. Beside it the shipped run, a row per block: what is lost by it.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from twin.run.replay import replay, replay_drive  # isort: skip  first: it prepares JAX before NumPy is loaded

import numpy as np

from models.scripts import load_script
from twin.build.product import build_artefact
from twin.logs.block_file import decode, encode
from twin.logs.blocks import Block, group, tables
from twin.logs.read import read_run
from twin.logs.resolver import Resolver
from twin.logs.run import Table
from twin.rom.artefact import read_artefact
from twin.rom.drive import Drive, evaluate
from twin.rom.following import Following
from twin.rom.load_model import LoadModel

FOLDER = Path(__file__).parents[1] / "models" / "hexapod"
START, DT, PIECE = 1.772e9, 60.0, 600.0  # s: of the log, of a step, of what is evaluated at once


def main() -> None:
    runs = load_script(FOLDER, "runs/make_runs.py")
    with tempfile.TemporaryDirectory() as scratch:
        path = Path(scratch) / "hexapod.h5"
        build_artefact(FOLDER / "machine.toml", path)
        artefact = read_artefact(path)
    load = artefact.model.load_model
    frames, sent = [], time.perf_counter()
    for block in blocks(runs):
        frames.append(encode(block))
    sent = time.perf_counter() - sent
    began = time.perf_counter()
    resolver, drives = Resolver(window=16), []
    for drive in evaluated(load, (t for f in frames for a in decode(f) for t in tables(resolver.push(a), START))):
        drives.append(drive)
    evaluating = time.perf_counter() - began
    whole = joined(drives)
    result = replay_drive(artefact, whole, np.zeros(6), None, 21.0)
    spent = time.perf_counter() - began
    size = sum(map(len, frames)) / 2**20
    hours = whole.time[-1] / 3600.0
    print(f"   {len(frames):,} blocks, {size:.0f} MiB, made in {sent:.0f} s; {resolver.counts}")
    print(f"   {hours:.1f} h in {spent:.1f} s ({evaluating:.1f} s from blocks to heat and contacts), "
          f"{3600 * hours / spent:,.0f} times faster than real time; "
          f"heat balance {result.balance_error.max():.0e}")  # fmt: skip
    rise = result.temperature[-1] - result.temperature[0]
    heat = result.power.mean(axis=0)
    for kind in ("motor", "nut", "screw", "bearing"):
        rises = [r for name, r in zip(result.sensors, rise, strict=True) if name.endswith(f"_{kind}")]
        watts = [p for name, p in zip(result.sources, heat, strict=True) if name.endswith(f"_{kind}")]
        told = [f"+{max(rises):.1f} K"] if rises else []
        told += [f"{max(watts):.1f} W on average"] if watts else []
        print(f"   {kind}: {', '.join(told)}")
    air = ", ".join(f"{n} +{r:.1f} K" for n, r in zip(result.sensors, rise, strict=True) if "strut" not in n)
    moved = 1e6 * np.abs(result.tcp - result.tcp[0]).max(axis=(0, 1))
    path = 1e6 * (result.tcp_actual - result.tcp_actual[0])
    print(f"   {air}; tool at the poses {moved[0]:.0f} / {moved[1]:.0f} / {moved[2]:.0f} um along x / y / z, "
          f"on the path {path[:, 2].min():.0f} um along z, {np.abs(path[:, :2]).max():.1f} um aside")  # fmt: skip
    shipped = replay(artefact, read_run(FOLDER / "runs" / "mixed_paths"), DT)
    n = min(len(result.time), len(shipped.time))
    apart = np.abs(result.temperature[:n] - shipped.temperature[:n])
    tcp = np.abs(result.tcp[:n] - shipped.tcp[:n])
    worst = int(apart.max(axis=0).argmax())
    print(f"   a row per block instead: {apart.max():.3f} K ({result.sensors[worst]}) of a rise of "
          f"{np.ptp(result.temperature[:, worst]):.1f} K, {1e6 * tcp.max():.2f} of "
          f"{1e6 * np.abs(result.tcp - result.tcp[0]).max():.1f} um at the poses")  # fmt: skip


def blocks(runs: Any) -> Iterator[Block]:
    """What the control sends: 2,880 blocks of 1,000 records of 19 signals."""

    def records() -> Iterator[np.ndarray]:
        for first in range(0, round(runs.HOURS * 3600.0 / runs.CORE), runs.PER_BLOCK):
            air = runs.ambient(runs.CORE * np.arange(first, first + runs.PER_BLOCK))
            yield np.column_stack([runs.records(first, runs.PER_BLOCK), air])

    names, units = (*runs.NAMES, "ambient"), (*runs.UNITS, "degC")
    return group(records(), names, units, START, runs.CORE, runs.PER_BLOCK, stream=1)


def evaluated(load: LoadModel, log: Iterator[Table]) -> Iterator[Drive]:
    """The drive in pieces of whole steps; each ends with the first record of the next, to which positions run."""
    waiting: list[Table] = []
    for table in log:
        waiting.append(table)
        if table.time[-1] - waiting[0].time[0] >= PIECE:
            at = np.concatenate([w.time for w in waiting])
            columns = {n: np.concatenate([w.columns[n] for w in waiting]) for n in table.columns}
            cut = int(np.searchsorted(at, at[0] + PIECE - 1e-9))
            upto = slice(0, cut + 1)
            yield evaluate(load, at[upto], {n: v[upto] for n, v in columns.items()}, DT, round(PIECE / DT))
            waiting = [Table(at[cut:], {n: v[cut:] for n, v in columns.items()}, table.units)]
    at = np.concatenate([w.time for w in waiting])
    columns = {n: np.concatenate([w.columns[n] for w in waiting]) for n in waiting[0].columns}
    steps = round((at[-1] - at[0]) / DT)
    if steps:
        yield evaluate(load, at, columns, DT, steps)


def joined(drives: list[Drive]) -> Drive:
    """One drive after the other."""
    first = drives[0]
    changed: dict[str, Any] = {}
    for field in fields(Drive):
        values = [getattr(drive, field.name) for drive in drives]
        if field.name == "time":
            changed["time"] = np.concatenate([values[0], *(v[1:] for v in values[1:])]) - values[0][0]
        elif isinstance(values[0], Following):
            own = {key: np.concatenate([getattr(v, key) for v in values]) for key in ("value", "outside")}
            changed[field.name] = replace(values[0], **own)
        elif isinstance(values[0], np.ndarray):
            changed[field.name] = np.concatenate(values)
    return replace(first, **changed)
