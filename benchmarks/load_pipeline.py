"""Loads at full rate (paper 001): 6 axes x 3 signals at 100 Hz for 8 h, from blocks to heat and contacts.

The link loses, repeats and reorders some blocks. Everything runs piece by piece, so memory does not grow with the log.
Two sets of losses: by the log alone, and with windings that follow their temperature, which tabulates them per step.
"""

from __future__ import annotations

import resource
import time
from collections.abc import Iterable, Iterator

import numpy as np

from twin.logs.block_file import decode, encode
from twin.logs.blocks import Block, group, tables
from twin.logs.resolver import Resolver
from twin.logs.run import Table
from twin.rom.drive import Drive, evaluate
from twin.rom.load_model import AxisWiring, EnvironmentWiring, Film, LawUse, LoadModel, Pair, Rail, Signal, Source

AXES = ("x1", "x2", "y1", "y2", "z1", "z2")
KINDS = {"position": ("m", -0.4, 0.4), "speed": ("m/s", -1.0, 1.0), "current": ("A", 0.0, 30.0)}
NAMES = tuple(f"{axis}_{kind}" for axis in AXES for kind in KINDS)
UNITS = tuple(unit for _ in AXES for unit, _, _ in KINDS.values())
CORE, HOURS, PER_BLOCK = 0.01, 8.0, 1000  # s, h, records: blocks of 10 s as for MiniHex
DT, PIECE = 60.0, 600.0  # s: step of the thermal model, time evaluated at once
START = 1.772e9


def main() -> None:
    for name, motor in (("losses by the log", "motor_copper"), ("windings by their temperature", "motor_winding")):
        run(name, load_model(motor))


def run(name: str, load: LoadModel) -> None:
    resolver, spent, sent, rows, heat = Resolver(window=16), {"sender": 0.0, "blocks": 0.0}, 0, 0, 0.0
    list(evaluated(load, log_of(decode(encode(next(blocks()))), Resolver()), 1.0))  # compiles
    frames = link(blocks())

    def arrivals() -> Iterator[Table]:
        nonlocal sent, rows
        mark = time.perf_counter()
        for frame in frames:
            now = time.perf_counter()
            spent["sender"] += now - mark
            sent += len(frame)
            made = list(log_of(decode(frame), resolver))
            rows += sum(len(table.time) for table in made)
            spent["blocks"] += time.perf_counter() - now
            yield from made
            mark = time.perf_counter()

    began, cpu = time.perf_counter(), time.process_time()
    for drive in evaluated(load, arrivals(), PIECE):
        heat += float(drive.power.sum()) * DT
    total, cpu = time.perf_counter() - began, time.process_time() - cpu
    work = total - spent["sender"]
    print(f"   {name}: {rows:,} rows of {len(NAMES)} signals, {sent / 2**20:.0f} MiB; {resolver.counts}")
    print(f"     blocks {spent['blocks']:.1f} s, drive {work - spent['blocks']:.1f} s, sender {spent['sender']:.1f} s"
          f" ({cpu:.1f} s of a core in all); {heat / 3.6e6:.2f} kWh by the log alone")  # fmt: skip
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10
    print(
        f"     8 h in {work:.1f} s: {HOURS * 3600 / work:,.0f} times faster than real time; peak memory {peak:.0f} MiB"
    )


def blocks() -> Iterator[Block]:
    """The sender: axes to and fro at different paces, currents with the acceleration and some noise."""
    rng = np.random.default_rng(0)

    def records() -> Iterator[np.ndarray]:
        for first in range(0, round(HOURS * 3600 / CORE), PER_BLOCK):
            t = CORE * np.arange(first, first + PER_BLOCK)
            columns = []
            for k in range(len(AXES)):
                pace = 2 * np.pi / (7.0 + 3.1 * k)
                noise = rng.standard_normal(PER_BLOCK)
                columns += [
                    0.4 * np.sin(pace * t),
                    0.4 * pace * np.cos(pace * t),
                    abs(5.0 + 4.0 * np.sin(pace * t) + noise),
                ]
            yield np.column_stack(columns)

    return group(records(), NAMES, UNITS, START, CORE, PER_BLOCK, stream=1)


def link(sent: Iterable[Block]) -> Iterator[bytes]:
    """Loses 1 block of 300, repeats 1 of 200, holds 1 of 50 back until after the next."""
    held: bytes | None = None
    for block in sent:
        s, frame = block.sequence, encode(block)
        if s % 300 == 123:
            continue
        if s % 50 == 7 and held is None:
            held = frame
            continue
        yield frame
        if held is not None:
            yield held
            held = None
        if s % 200 == 99:
            yield frame


def log_of(arrivals: Iterable, resolver: Resolver) -> Iterator[Table]:
    """What a frame brings into order; gaps stay gaps in time, whose last values are held."""
    for arrival in arrivals:
        yield from tables(resolver.push(arrival), START)


def evaluated(load: LoadModel, log: Iterable[Table], piece: float) -> Iterator[Drive]:
    """The drive in pieces of whole steps; each ends with the first record of the next, to which positions run."""
    waiting: list[Table] = []
    for table in log:
        waiting.append(table)
        if table.time[-1] - waiting[0].time[0] < piece:
            continue
        time = np.concatenate([w.time for w in waiting])
        columns = {n: np.concatenate([w.columns[n] for w in waiting]) for n in NAMES}
        end = time[0] + piece
        cut = int(np.searchsorted(time, end - 1e-9))
        upto = slice(0, cut + 1)
        yield evaluate(
            load, time[upto], {n: v[upto] for n, v in columns.items()}, min(DT, piece), round(piece / DT) or 1
        )
        waiting = [Table(time[cut:], {n: v[cut:] for n, v in columns.items()}, table.units)]


def load_model(motor: str) -> LoadModel:
    """Six axes, each with a motor, a screw with its nut, and four carriages on two rails."""
    signals, axes, sources, rails, pairs, films = [], [], [], [], [], []
    ports: list[str] = []
    for a, axis in enumerate(AXES):
        signals += [
            Signal(f"{axis}_{k}", f"{axis}_{k}", unit, "value", low, high) for k, (unit, low, high) in KINDS.items()
        ]
        axes.append(AxisWiring(axis, (1.0, 0.0, 0.0), -0.4, 0.4, f"{axis}_position"))
        speed, screw = {"speed": f"{axis}_speed"}, {"force": 500.0, "preload": 1500.0, "diameter": 0.04, "lead": 0.02}
        sources += [
            Source(f"{axis}_motor", LawUse(motor, {"resistance": 0.4}, {"current": f"{axis}_current"}), 1.0, "", 0.0),
            Source(f"{axis}_nut", LawUse("screw_friction", screw, speed), 1.0, f"{axis}_screw", 0.5),
            Source(f"{axis}_guide", LawUse("guide_friction", {"load": 5e3}, speed), 1.0, f"{axis}_guide", 0.5),
        ]
        films.append(Film(axis, LawUse("forced_film", {"natural": 6.0, "forced": 12.0}, speed), 0, 4.0, 40.0))
        for rail, pads in ((f"{axis}_screw", (0.0,)), (f"{axis}_guide", (-0.1, 0.1)), (f"{axis}_guide", (-0.1, 0.1))):
            rails.append(Rail(f"{rail}_{len(rails)}", len(ports), tuple(np.linspace(-0.6, 0.6, 12))))
            ports += [f"{rails[-1].name}[{i}]" for i in range(12)]
            for station in pads:
                pairs.append(Pair(rail, a, len(rails) - 1, len(ports), station, False, 4e-3, 3e3))
                ports.append(f"{rails[-1].name}.pad_{station}")
    return LoadModel(
        tuple(signals), tuple(axes), (EnvironmentWiring("hall", "", 21.0),), tuple(sources), tuple(films), (),
        tuple(ports), tuple(rails), tuple(pairs),
    )  # fmt: skip
