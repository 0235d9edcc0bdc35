"""The process beside the machine: latency, memory, start, twenty kills in 8 h, a long replay."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from array import array
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np

import twin
from benchmarks.five_axis import FOLDER
from benchmarks.live_sender import STREAM, blocks
from twin.live.block import Block
from twin.live.checkpoint import Checkpoint, read_checkpoint
from twin.live.ring import RingReader, RingWriter
from twin.logs.block_file import read_blocks
from twin.logs.read import read_run
from twin.logs.signals import signal_values
from twin.rom.drive import evaluate

RUN = FOLDER / "runs" / "experiment_a"
RECORDS, CORE = 1000, 0.01  # records of a block and s between them: 100 Hz in blocks of 10 s, as for MiniHex
LATENCY_BLOCKS = 240  # 40 min: one of six completes a step of a minute
SCRIPT = "from twin.cli.main import main; main()"  # of the command that an installation has
WARM = 13  # first blocks that are not counted: caches are cold, JAX compiles
STARTS = 5
KILLS, SPEED, GROUP, HOURS = 20, 1000.0, 10, 8.0
# of the long replay, which is looked at once a second: shorter ones are over before their second day is seen
DAYS = max(float(os.environ.get("TWIN_LIVE_DAYS", "30")), 4.0)
ROW = 60.0  # s between its rows


@cache
def artefact() -> Path:
    """That of `make demo`, where it is there."""
    made = Path("out") / "five_axis.h5"
    if not made.is_file():
        twin.build(FOLDER).save(made)
    return made


def command(source: str, out: list[str], state: Path, *more: str) -> list[str]:
    given = [part for text in out for part in ("--out", text)]
    return [sys.executable, "-c", SCRIPT, "live", str(artefact()), "--source", source, *given,
            "--state", str(state), "--initial", "22 degC", *more]  # fmt: skip


def memory(pid: int, key: str) -> float:
    """MB, of VmRSS or VmHWM."""
    text = Path(f"/proc/{pid}/status").read_text()
    return int((text.partition(f"{key}:")[2].split() or ["0"])[0]) / 1024.0  # none of a process that has ended


def cpu(pid: int) -> float:
    """s of a core that a process has used: what is left of a time where others use the computer too."""
    try:
        told = [(task / "schedstat").read_text() for task in Path(f"/proc/{pid}/task").iterdir()]
    except OSError:  # a thread, or all, has just ended
        return 0.0
    return sum(int(t.split()[0]) for t in told) * 1e-9


def until(condition: Callable[[], bool], seconds: float = 120.0, pause: float = 0.001) -> None:
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise RuntimeError("nothing happens")
        time.sleep(pause)


def at_100_hz(count: int) -> Iterator[Block]:
    """Every signal of the machine at 100 Hz: six positions and speeds, currents, air; axes to and fro."""
    first = blocks(RUN / "loads.csv", 1)[0]
    t0 = np.arange(RECORDS) * CORE
    rng = np.random.default_rng(0)
    base = np.array(list(first.values))
    for k in range(count):
        t = t0 + k * RECORDS * CORE
        values = np.tile(base, (RECORDS, 1))
        for column, name in enumerate(first.names):
            if name.endswith("_position"):
                values[:, column] = 0.05 * np.sin(2 * np.pi * t / (7.0 + column))
            elif name.endswith("_speed"):
                values[:, column] = abs(base[column]) * (1.0 + 0.1 * np.cos(2 * np.pi * t / (7.0 + column)))
            elif name.endswith("_current"):
                values[:, column] = abs(base[column] + 0.3 * rng.standard_normal(RECORDS))
        data = array("d", values.ravel().tolist())
        yield Block(STREAM, k, 1.8e9 + k * RECORDS * CORE, CORE, first.names, first.units, data)


def taken(reader: RingReader) -> int:
    """The number of the last block that the newest correction includes."""
    newest = reader.newest()
    return -1 if newest is None else int(newest.values[2])


def latency(engine: str, folder: Path) -> None:
    """One block after the other, each sent when the one before is answered."""
    ring, out = folder / "in", folder / "out"
    writer = RingWriter(ring, slots=16, slot=1 << 19)
    process = subprocess.Popen(
        command(f"ring:{ring}", [f"ring:{out}"], folder / "state", "--engine", engine), stdout=subprocess.DEVNULL
    )
    until(out.is_file, 300.0)
    reader, waits, spent = RingReader(out), [], [cpu(process.pid)]
    for block in list(at_100_hz(LATENCY_BLOCKS)):
        began = time.perf_counter()
        writer.write(block)
        until(lambda n=block.sequence: taken(reader) >= n, pause=0.0005)
        waits.append(1e3 * (time.perf_counter() - began))
        spent.append(cpu(process.pid))
        if block.sequence == 0:
            print(f"   {engine}: first block of the first start answered after {waits[0]:.0f} ms")
    used = 1e3 * np.diff(spent)[WARM:]
    resident, most = memory(process.pid, "VmRSS"), memory(process.pid, "VmHWM")
    process.terminate()
    process.wait()
    told = json.loads((folder / "state" / "health.json").read_text())
    warm = np.array(waits[WARM:])
    stepping = warm[[i for i in range(len(warm)) if (i + WARM) % 6 == 0]]
    print(f"   {engine}: block of {RECORDS} records x {len(block.names)} signals in to correction out, median "
          f"{np.median(warm):.1f} ms, 99th percentile {np.quantile(warm, 0.99):.1f} ms (asked 50), of blocks that "
          f"complete a step with 125 poses {np.median(stepping):.1f} / {np.quantile(stepping, 0.99):.1f} ms; "
          f"{used.mean():.1f} ms of a core per block, 99th percentile {np.quantile(used, 0.99):.1f} ms")  # fmt: skip
    print(f"   {engine}: resident {resident:.0f} MB, at most {most:.0f} MB (asked {60 if engine == 'c' else 300}); "
          f"{told['model']['steps']} steps, balance {told['model']['worst_balance_error']:.1e}")  # fmt: skip


def start(engine: str, folder: Path) -> None:
    """From the start of the process to the first correction, with the state that `latency` has left."""
    out, waits, bare, spent = folder / "out", [], [], []
    for _ in range(STARTS):
        reader = RingReader(out)
        before = reader.next()
        began = time.perf_counter()
        process = subprocess.Popen(
            command(f"ring:{folder / 'in'}", [f"ring:{out}"], folder / "state", "--engine", engine),
            stdout=subprocess.DEVNULL,
        )
        until(lambda r=reader, b=before: r.next() != b, pause=0.0005)
        waits.append(time.perf_counter() - began)
        spent.append(cpu(process.pid))
        process.terminate()
        process.wait()
        reader.close()
        began = time.perf_counter()
        subprocess.run([sys.executable, "-c", "pass"], check=True)
        bare.append(time.perf_counter() - began)
    print(f"   {engine}: first correction of a warm start after {min(waits):.2f} s at best, {np.median(waits):.2f} s "
          f"median of {STARTS} (asked {0.1 if engine == 'c' else 3}), {np.median(spent):.2f} s of a core; Python alone "
          f"{np.median(bare):.3f} s")  # fmt: skip


def heat(journal: Path) -> float:
    """J that the losses by the log alone make of all blocks in a journal."""
    load = twin.read(artefact()).artefact.model.load_model
    found = [b for path in sorted(journal.glob("*.twb")) for b in read_blocks(path) if hasattr(b, "values")]
    times = np.concatenate([b.time + b.interval * np.arange(len(b.values)) for b in found])
    columns = {n: np.concatenate([b.values[:, k] for b in found]) for k, n in enumerate(found[0].names)}
    return _heat(load, times, {s.name: s.factor * columns[s.column] for s in load.signals if s.column in columns})


def _heat(load: object, times: np.ndarray, signals: dict[str, np.ndarray]) -> float:
    drive = evaluate(load, times, signals, 60.0, round(HOURS * 60) - 1)  # type: ignore[arg-type]
    warm = np.full(len(drive.losses.index), 0)  # windings read in the middle of their table: equal for both
    tables = drive.losses.value[:, np.arange(len(warm)), 40].sum() if len(warm) else 0.0
    return float((drive.power.sum() + tables) * 60.0)


def uninterrupted(folder: Path, rows: Path) -> Checkpoint:
    """The same blocks by a process that nobody kills, as fast as they go."""
    ring, out = folder / "in", folder / "out"
    writer = RingWriter(ring, slots=512, slot=1 << 14)
    sent = blocks(rows, GROUP)
    for block in sent:
        writer.write(block)
    process = subprocess.Popen(command(f"ring:{ring}", [f"ring:{out}"], folder / "state"), stdout=subprocess.DEVNULL)
    until(out.is_file)
    reader = RingReader(out)
    until(lambda: taken(reader) == sent[-1].sequence, pause=0.01)
    process.terminate()
    process.wait()
    found = read_checkpoint(folder / "state" / "checkpoint.bin")
    assert found is not None
    return found


def kills(folder: Path, engines: Path) -> None:
    rows = folder / "loads.csv"
    lines = (RUN / "loads.csv").read_text().splitlines(keepends=True)
    rows.write_text("".join(lines[: 1 + round(HOURS * 360)]))
    for name in ("whole", "killed"):
        shutil.copytree(engines, folder / name / "state" / "engine")
    whole = uninterrupted(folder / "whole", rows)

    here, rng = folder / "killed", random.Random(0)
    ring, out = here / "in", here / "out"
    began = time.monotonic()
    span = HOURS * 3600.0 / SPEED

    def sender() -> subprocess.Popen:
        return subprocess.Popen([sys.executable, "-m", "benchmarks.live_sender", str(rows), str(ring), str(GROUP),
                                 str(SPEED), str(began)])  # fmt: skip

    def runtime() -> subprocess.Popen:
        return subprocess.Popen(command(f"ring:{ring}", [f"ring:{out}"], here / "state"), stdout=subprocess.DEVNULL)

    running = {"sender": sender(), "runtime": runtime()}
    counts = dict.fromkeys(running, 0)
    for moment in sorted(rng.uniform(0.02, 0.98) * span for _ in range(KILLS)):
        time.sleep(max(began + moment - time.monotonic(), 0.0))
        which = rng.choice(tuple(running))
        running[which].send_signal(signal.SIGKILL)
        running[which].wait()
        counts[which] += 1
        running[which] = sender() if which == "sender" else runtime()
    running["sender"].wait()
    last = blocks(rows, GROUP)[-1].sequence
    until(out.is_file)
    reader = RingReader(out)
    until(lambda: taken(reader) == last or running["runtime"].poll() is not None, pause=0.01)
    took = time.monotonic() - began
    running["runtime"].terminate()
    running["runtime"].wait()
    told = json.loads((here / "state" / "health.json").read_text())
    found = read_checkpoint(here / "state" / "checkpoint.bin")
    assert found is not None
    same = found.engine == whole.engine
    all_heat, kept = heat(folder / "whole" / "state" / "journal"), heat(here / "state" / "journal")
    print(f"   {HOURS:g} h at {SPEED:g} times in {took:.0f} s, {KILLS} kills ({counts['sender']} of the sender, "
          f"{counts['runtime']} of the process): {100 * abs(1 - kept / all_heat):.4f} % of {all_heat / 3.6e6:.2f} kWh "
          f"lost (asked 0.1), state {'the same to the last bit' if same else 'NOT THE SAME'}, "
          f"{told['input']['gaps']} gaps")  # fmt: skip


def long_replay(folder: Path, engines: Path) -> None:
    """Experiment A again and again, a row a minute."""
    run = read_run(RUN)
    load = twin.read(artefact()).artefact.model.load_model
    assert signal_values(run, load.signals)
    one = blocks(RUN / "loads.csv", 1)[:: round(ROW / 10.0)]
    folder.mkdir()
    csv = folder / "run" / "loads.csv"
    csv.parent.mkdir()
    with csv.open("w") as f:
        f.write(",".join(["time [s]", *(f"{n} [{u}]" for n, u in zip(one[0].names, one[0].units, strict=True))]) + "\n")
        for k in range(round(DAYS * 86400.0 / ROW)):
            f.write(
                ",".join([f"{ROW * k:g}" if k < 16_000 else str(int(ROW * k)), *map(repr, one[k % len(one)].values)])
                + "\n"
            )
    state = folder / "state"
    shutil.copytree(engines, state / "engine")
    began = time.perf_counter()
    process = subprocess.Popen(command(f"replay:{csv.parent}", [f"ring:{folder / 'c'}"], state, "--speed", "0",
                                       "--journal", "1"), stdout=subprocess.PIPE, text=True)  # fmt: skip
    seen: list[tuple[float, float, float]] = []
    spent = 0.0
    while process.poll() is None:
        time.sleep(1.0)
        try:
            day = json.loads((state / "health.json").read_text())["model"]["time_s"] / 86400.0
            resident, spent = memory(process.pid, "VmRSS"), max(cpu(process.pid), spent)
        except (OSError, ValueError):
            continue
        disk = sum(p.stat().st_size for p in state.rglob("*") if p.is_file() and "engine" not in p.parts) / 2**20
        if resident:
            seen.append((day, resident, disk))
    told = json.loads((state / "health.json").read_text())
    after = np.array([s for s in seen if s[0] >= 1.0])
    first, last = after[0], after[-max(len(after) // 10, 1) :]
    full = after[after[:, 2].argmax()]
    steps = told["model"]["steps"]
    print(f"   {told['model']['time_s'] / 86400:.0f} days, {steps:,} steps in {time.perf_counter() - began:.0f} s, "
          f"{1e3 * spent / steps:.2f} ms of a core each: resident {first[1]:.1f} MB after day {first[0]:.0f}, then at "
          f"most {after[:, 1].max():.1f}, in the last tenth {last[:, 1].mean():.1f}; state folder {first[2]:.2f} MB, "
          f"at most {full[2]:.2f} on day {full[0]:.0f}, in the last tenth {last[:, 2].mean():.2f} (journal of 1 MB, "
          f"full after five days)")  # fmt: skip


def main() -> None:
    load = os.getloadavg()[0]
    print(f"   load of this computer at the beginning: {load:.1f} on {os.cpu_count()} cores")
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for engine in ("c", "jax"):
            (folder / engine).mkdir()
            latency(engine, folder / engine)
            start(engine, folder / engine)
        engines = folder / "c" / "state" / "engine"
        (folder / "kills").mkdir()
        kills(folder / "kills", engines)
        long_replay(folder / "long", engines)
