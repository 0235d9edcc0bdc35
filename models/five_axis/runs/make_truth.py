"""Another machine as truth: `python make_truth.py -o FOLDER` steps a disturbed full model through experiments A and B.

The description is this machine's with every source's gain, film's gain and fixed contact's conductance off by
+-30 % (signs drawn by --seed), on another mesh (needs gmsh; --size 0 keeps the shipped one). What a twin of the nominal
description has to make up for by measuring. FOLDER gets per experiment three run folders:

- experiment_a: what is measured. 32 temperatures every minute with noise of 0.08 K, an R-test every hour and at the
  start, at the middle of all axes, with noise of 1 um.
- experiment_a_truth: the TCP error at the middle of all axes every minute, without noise.
- experiment_a_path: the same at the logged positions.

machine/ is the disturbed description. About two minutes each on one core. Needs the extra `build` of the package.
"""

from __future__ import annotations

import argparse
import re
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from twin.build.remesh import remesh
from twin.build.simulate import simulate_run
from twin.logs.read import read_run
from twin.logs.run import Run, Table, Tcp
from twin.logs.write import refuse_to_destroy, write_run, write_tcp
from twin.machine.load import load_machine

HERE = Path(__file__).parent
EXPERIMENTS = ("experiment_a", "experiment_b")
KINDS = ("sources", "films", "contacts")
MINUTE, HOUR = 60.0, 3600.0


def disturbed(text: str, size: float, seed: int) -> tuple[str, dict[str, float]]:
    """The text of machine.toml with gains and conductances times 1 + size or 1 - size; what was multiplied by what.

    Tables without a gain get one. Moving contacts stay as they are: the loads of a guide depend on them little.
    """
    rng = np.random.default_rng(seed)
    factors: dict[str, float] = {}
    pieces = re.split(r"(?m)^(?=\[)", text)
    for i, piece in enumerate(pieces):
        header = re.match(r"\[(\w+)\.(\w+)\]", piece)
        if header is None or header[1] not in KINDS or 'kind = "moving"' in piece:
            continue
        factor = 1.0 + size * float(rng.choice([-1.0, 1.0]))
        if header[1] == "contacts":
            path, old = "conductance", re.search(r'(?m)^conductance = "([\d.e+-]+)( .*)"', piece)
            assert old is not None, f"contacts.{header[2]} has no conductance"
            pieces[i] = piece.replace(old[0], f'conductance = "{float(old[1]) * factor:g}{old[2]}"')
        else:
            path, old = "gain", re.search(r"(?m)^gain = ([\d.]+)", piece)
            line = f"gain = {(float(old[1]) if old else 1.0) * factor:g}"
            pieces[i] = piece.replace(old[0], line) if old else piece.replace(header[0], f"{header[0]}\n{line}", 1)
        factors[f"{header[1]}.{header[2]}.{path}"] = factor
    return "".join(pieces), factors


def every_minute(run: Run, at: np.ndarray | None) -> Tcp:
    """Rows every minute, at one position (3,) [m] or at the logged ones; displacements are still to come."""
    time = np.arange(0.0, run.loads.time[-1] + MINUTE / 2, MINUTE)
    logged = [np.interp(time, run.loads.time, run.loads.columns[f"{a}_position"]) for a in "xyz"]
    position = np.column_stack(logged) if at is None else np.tile(at, (len(time), 1))
    return Tcp(time, ("x", "y", "z"), position, np.zeros((len(time), 3)))


def truth(machine: Path, name: str, size: float | None) -> Run:
    """Every minute without noise, rows at the middle first, then those at the logged positions."""
    run = read_run(HERE / name)
    middle, path = every_minute(run, np.zeros(3)), every_minute(run, None)
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(HERE / name, folder, dirs_exist_ok=True)
        both = Tcp(
            np.concatenate([middle.time, path.time]), middle.axes, np.vstack([middle.position, path.position]),
            np.vstack([middle.displacement, path.displacement]),
        )  # fmt: skip
        write_tcp(Path(folder) / "tcp.csv", both)
        described = load_machine(machine)
        found, balance = simulate_run(remesh(described, size) if size else described, Path(folder))
    print(f"{name}: heat balance closes to {balance:.1e} of the throughput", flush=True)
    return found


def rows(tcp: Tcp, which: np.ndarray) -> Tcp:
    return Tcp(tcp.time[which], tcp.axes, tcp.position[which], tcp.displacement[which])


def measured(run: Run, middle: Tcp, noise: float, tcp_noise: float, seed: int) -> Run:
    """Sensors every minute and R-tests every hour, with noise [K], [m]; the first R-test ends 5 min after the start."""
    rng = np.random.default_rng(seed)
    assert run.temperatures is not None
    noisy = {k: v + noise * rng.standard_normal(len(v)) for k, v in run.temperatures.columns.items()}
    tests = rows(middle, np.isclose(middle.time % HOUR, 0.0) & (middle.time > 0) | np.isclose(middle.time, 5 * MINUTE))
    sigma = np.full(len(tests.time), tcp_noise) if tcp_noise > 0 else None
    displacement = tests.displacement + tcp_noise * rng.standard_normal(tests.displacement.shape)
    return replace(
        run,
        temperatures=Table(run.temperatures.time, noisy, run.temperatures.units),
        tcp=replace(tests, displacement=displacement, sigma=sigma),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the run folders")
    parser.add_argument("--off", type=float, default=0.3, help="by how much parameters are off, default 0.3")
    parser.add_argument("--seed", type=int, default=1, help="of the signs, default 1; the noise has its own")
    parser.add_argument("--size", type=float, default=0.09, help="of the mesh [m], default 0.09; 0: the shipped one")
    parser.add_argument("--noise", type=float, default=0.08, help="standard deviation [K], default 0.08")
    parser.add_argument("--tcp-noise", type=float, default=1.0, help="standard deviation [um], default 1")
    arguments = parser.parse_args()
    folders = [arguments.output / f"{name}{kind}" for name in EXPERIMENTS for kind in ("", "_truth", "_path")]
    for folder in folders:
        refuse_to_destroy(folder)
    machine = arguments.output / "machine"
    machine.mkdir(parents=True, exist_ok=True)
    for script in HERE.parent.glob("*.py"):
        shutil.copy(script, machine)
    shutil.copytree(HERE.parent / "mesh", machine / "mesh", dirs_exist_ok=True)
    text, factors = disturbed((HERE.parent / "machine.toml").read_text(encoding="utf-8"), arguments.off, arguments.seed)
    (machine / "machine.toml").write_text(text, encoding="utf-8")
    print(f"{len(factors)} parameters: {', '.join(f'{k} x {v:g}' for k, v in factors.items())}", flush=True)
    for number, name in enumerate(EXPERIMENTS):
        run = truth(machine, name, arguments.size or None)
        assert run.tcp is not None
        half = len(run.tcp.time) // 2
        middle, path = rows(run.tcp, np.arange(half)), rows(run.tcp, np.arange(half, 2 * half))
        noise = (arguments.noise, arguments.tcp_noise * 1e-6)
        write_run(arguments.output / name, measured(run, middle, *noise, 100 * arguments.seed + number))
        write_run(arguments.output / f"{name}_truth", replace(run, tcp=middle))
        write_run(arguments.output / f"{name}_path", replace(run, tcp=path))


if __name__ == "__main__":
    main()
