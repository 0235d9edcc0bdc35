"""Truth for hidden effects: another five-axis machine, stepped through the runs for diagnosis.

The twin under trial knows the shipped description. The truth is a machine that differs from it as a real one would: its
own mesh, other laws of its films (so that no gain makes up for them), other emissivities, sensors some millimetres
aside, gains, conductances, capacities and expansions off by what a designer does not know. What is hidden comes on top,
as an edit of its text.

    python -m benchmarks.hidden_truth           # one run of one machine: nodes and seconds

Needs gmsh for the mesh (`twin.build.remesh`), once. Results are kept in the cache folder, by the text of the
description and of the loads; delete `hidden-truth` there after changes of the physics. Those that tests need without
gmsh lie in tests/hidden/truth (`store`).
"""

from __future__ import annotations

import hashlib
import re
import resource
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.five_axis import FOLDER
from tests.hidden.load import RUNS, Truth, plan, write
from twin.atomic import atomic_path
from twin.build.cache import folder
from twin.build.full_model import FullModel, assemble
from twin.build.remesh import remesh
from twin.build.simulate import simulate
from twin.logs.read import read_run
from twin.logs.run import Run, Table
from twin.logs.signals import signal_values
from twin.machine.description import Machine
from twin.machine.edit import edited
from twin.machine.load import load_machine
from twin.machine.parameters import parameters
from twin.rom.drive import evaluate
from twin.rom.parameter import Parameter

OTHER_MESH = 0.16  # m, element size: the artefact's mesh has 0.12
STEP, SUBSTEPS = 60.0, 4
START = 22.0  # degC
ASIDE = 0.008  # m, the largest distance of a sensor from where the description has it
# Half widths of uniform factors around 1, by kind of parameter
OFF: dict[str, float] = {
    "source": 0.15, "film": 0.15, "joint": 0.15, "contact": 0.15, "capacity": 0.05, "expansion": 0.03,
}  # fmt: skip
EXPONENT = 0.08  # half width of what is added to exponents of films


@dataclass(frozen=True)
class OtherFilm:
    """The law that a film really has, near the described one in mid-range (`python -m benchmarks.hidden_truth`)."""

    law: str
    parameters: Mapping[str, str | float]
    signal: str = ""  # that its speed reads
    emissivity: float = 0.84  # paint that has aged
    gain: float = 1.0  # on top of the described one


def _vertical(height: float, gain: float, emissivity: float) -> OtherFilm:
    return OtherFilm("free_vertical_plate_laminar", {"height": f"{height} m"}, "", emissivity, gain)


def _forced(natural: float, forced: float, exponent: float, signal: str, emissivity: float = 0.84) -> OtherFilm:
    values: dict[str, str | float] = {
        "natural": f"{natural} W/(m^2*K)",
        "forced": f"{forced} W/(m^2*K)",
        "exponent": exponent,
    }
    return OtherFilm("forced_film", values, signal, emissivity)


FILMS: dict[str, OtherFilm] = {
    "bed": _forced(2.3, 5.5, 0.75, "draught"),
    "bed_inside": OtherFilm("constant_film", {"natural": "1.7 W/(m^2*K)"}, "", 0.0),
    "column": _vertical(1.5, 1.5, 0.15),  # the wind of X is a constant part
    "column_inside": OtherFilm("constant_film", {"natural": "0.6 W/(m^2*K)"}, "", 0.0),
    "axis_motors": _forced(3.0, 9.5, 0.8, "draught"),
    "y_motor": _forced(4.0, 6.5, 0.7, "x_speed"),  # some 15 K above the air
    "headstock": _forced(2.4, 4.5, 0.7, "x_speed"),
    "headstock_ends": _vertical(0.5, 1.3, 0.84),
    "carriage": _forced(2.3, 4.5, 0.65, "z_speed"),
    "x_screw": _forced(3.6, 72.0, 0.65, "x_speed", 0.2),
    "y_screw": _forced(3.6, 72.0, 0.65, "y_speed", 0.2),
    "z_screw": _forced(3.6, 72.0, 0.65, "z_speed", 0.2),
}


def other_text(seed: int) -> str:
    """The description [text of a machine.toml] of the other machine of a seed; it has the names of the shipped one."""
    rng = np.random.default_rng(seed)
    text = (FOLDER / "machine.toml").read_text(encoding="utf-8")
    pieces = re.split(r"(?m)^(?=\[)", text)
    for i, piece in enumerate(pieces):
        header = re.match(r"\[(\w+)\.(\w+)\]", piece)
        if header and header[1] == "films":
            pieces[i] = _film_table(piece, FILMS[header[2]], rng.uniform(-EXPONENT, EXPONENT))
        elif header and header[1] == "sensors" and (place := re.search(r"position = \[(.*)\]", piece)):
            shift = rng.standard_normal(3)
            shift *= ASIDE * rng.uniform() ** (1.0 / 3.0) / np.linalg.norm(shift)
            moved = np.array([float(v) for v in place[1].split(",")]) + shift
            pieces[i] = piece.replace(place[0], f"position = [{', '.join(f'{v:.4f}' for v in moved)}]")
    text = "".join(pieces)
    machine = load_machine(FOLDER / "machine.toml", text)
    own = [p for p in parameters(machine) if p.kind in OFF]
    return edited(text, {p.path: p.nominal * (1.0 + rng.uniform(-OFF[p.kind], OFF[p.kind])) for p in own})


def other_machine(seed: int, hide: Callable[[str], str] = str) -> Machine:
    """The other machine of a seed on its own mesh; hide: an edit of its text, in a hidden effect's way."""
    return machine_of(hide(other_text(seed)))


def machine_of(text: str, size: float = OTHER_MESH) -> Machine:
    """The machine of a description's text on a mesh of `size` [m]."""
    return remesh(load_machine(FOLDER / "machine.toml", text), size)


def other_parameters(seed: int) -> dict[str, tuple[Parameter, float]]:
    """What the other machine of a seed is off by: path -> (the parameter as described, its value there [SI]).

    A film's gain is there that of another law: it is not what a calibration should find.
    """
    described = {p.path: p for p in parameters(load_machine(FOLDER / "machine.toml"))}
    there = parameters(load_machine(FOLDER / "machine.toml", other_text(seed)))
    return {p.path: (described[p.path], p.nominal) for p in there if p.path in described}


def _film_table(piece: str, film: OtherFilm, exponent: float) -> str:
    """The table of a film with another law; surfaces, environment and comments stay."""
    gain = re.search(r"(?m)^gain = ([\d.]+)", piece)
    kept = re.sub(r"(?m)^(law|gain|emissivity|parameters|signals) = .*\n", "", piece).rstrip("\n")
    values = {k: v + exponent if isinstance(v, float) else v for k, v in film.parameters.items()}
    shown = ", ".join(f"{k} = " + (f'"{v}"' if isinstance(v, str) else f"{v:.3f}") for k, v in values.items())
    own, after = _before_comment(kept)
    lines = [own, f'law = "{film.law}"', f"gain = {(float(gain[1]) if gain else 1.0) * film.gain:g}",
             f"emissivity = {film.emissivity:g}", f"parameters = {{ {shown} }}"]  # fmt: skip
    if film.signal:
        lines.append(f'signals = {{ speed = "{film.signal}" }}')
    return "\n".join(lines) + "\n" + after + "\n"


def _before_comment(table: str) -> tuple[str, str]:
    """A table and the heading of the next section that stands behind it."""
    cut = re.search(r"(?m)^# ---", table)
    return (table, "") if cut is None else (table[: cut.start()].rstrip("\n"), "\n" + table[cut.start() :] + "\n")


def truth(
    text: str,
    run: str,
    extra: Mapping[str, np.ndarray] = {},
    before: float = 0.0,
    size: float = OTHER_MESH,
    model: Callable[[], FullModel] | None = None,
) -> Truth:
    """What the machine of a description really does in one of RUNS, without noise; from the cache where it is there.

    extra: signals that the machine feels and the log lacks or has wrong (n,) [SI], by name, at the rows of loads.csv.
    before [h]: so much of the run's own work comes before its start, so that the machine is not at START there. model:
    makes the full model of `text`, where several runs share it.
    """
    loads = FOLDER / "runs" / run / "loads.csv"
    digest = hashlib.sha256(text.encode() + loads.read_bytes() + f"{before:g} {size:g} {STEP} {SUBSTEPS}".encode())
    for name in sorted(extra):
        digest.update(name.encode() + np.asarray(extra[name], dtype=float).tobytes())
    path = folder() / "hidden-truth" / f"{run}-{digest.hexdigest()[:20]}.npz"
    if not path.exists():
        made = _simulated(machine_of(text, size) if model is None else None, model, run, extra, before)
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_path(path) as temporary, Path(temporary).open("wb") as f:
            np.savez(f, time=made.time, temperatures=made.temperatures, sensors=np.array(made.sensors),
                     tcp_time=made.tcp_time, positions=made.positions, tcp=made.tcp)  # fmt: skip
    with np.load(path) as data:
        return Truth(
            run, data["time"], data["temperatures"], tuple(str(s) for s in data["sensors"]), data["tcp_time"],
            data["positions"], data["tcp"],
        )  # fmt: skip


def truths(
    text: str, extra: Mapping[str, Mapping[str, np.ndarray]] = {}, before: Mapping[str, float] = {}
) -> tuple[Truth, ...]:
    """`truth` of all RUNS, the full model assembled at most once; extra and before by the run's name."""
    found: list[FullModel] = []

    def model() -> FullModel:
        if not found:
            found.append(assemble(machine_of(text)))
        return found[0]

    return tuple(truth(text, run, extra.get(run, {}), before.get(run, 0.0), model=model) for run in RUNS)


def store(name: str, text: str, extra: Mapping[str, Mapping[str, np.ndarray]] = {},
          before: Mapping[str, float] = {}, about: Mapping[str, object] = {}) -> Path:  # fmt: skip
    """Write the truth of a trial where tests find it; about: what is hidden, as JSON can say it."""
    return write(name, truths(text, extra, before), about)


def _simulated(
    machine: Machine | None,
    model: Callable[[], FullModel] | None,
    name: str,
    extra: Mapping[str, np.ndarray],
    before: float,
) -> Truth:
    if model is not None:
        full = model()
    else:
        assert machine is not None
        full = assemble(machine)
    run = read_run(FOLDER / "runs" / name)
    when, where = plan(run, full.thermal.pose_axes)
    felt, ahead = _felt(run, extra, before)
    load = full.thermal.load_model
    drive = evaluate(load, felt.loads.time, signal_values(felt, load.signals), STEP)
    made = simulate(full, drive, when + ahead, where, START, SUBSTEPS)
    kept = made.time >= ahead - 1e-6
    return Truth(name, made.time[kept] - ahead, made.temperatures[kept], made.sensors, when, where, made.tcp)


def _felt(run: Run, extra: Mapping[str, np.ndarray], before: float) -> tuple[Run, float]:
    """The run as the machine feels it, and the time [s] by which its start is late there."""
    columns = {**run.loads.columns, **extra}
    units = {**dict.fromkeys(extra, "1"), **run.loads.units}
    t = run.loads.time
    ahead = round(3600.0 * before / STEP) * STEP
    first = t < ahead  # the work of its first hours, once more
    joined = Table(
        np.concatenate([t[first], t + ahead]),
        {k: np.concatenate([v[first], v]) for k, v in columns.items()},
        units,
    )
    return replace(run, loads=joined), ahead


def main() -> None:
    text = other_text(0)
    began = time.perf_counter()
    full = assemble(machine_of(text))
    nodes = sum(body.n for body in full.thermal.bodies)
    print(f"   {nodes} nodes in {len(full.thermal.bodies)} bodies, assembled in {time.perf_counter() - began:.0f} s")
    for run in RUNS:
        began = time.perf_counter()
        made = _simulated(None, lambda: full, run, {}, 0.0)
        seconds = time.perf_counter() - began
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        rise, tcp = np.abs(made.temperatures - START).max(axis=0), 1e6 * np.abs(made.tcp).max(axis=0)
        warmest = made.sensors[int(rise.argmax())]
        print(
            f"   {run}: {made.time[-1] / 3600:.0f} h in {seconds:.0f} s, {memory:.1f} GiB; largest rise"
            f" {rise.max():.1f} K ({warmest}), TCP {tcp[0]:.0f} / {tcp[1]:.0f} / {tcp[2]:.0f} um",
            flush=True,
        )


if __name__ == "__main__":
    main()
