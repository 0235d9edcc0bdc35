"""Golden values of two small machines, from build to R-test: `python -m tests.golden.compute FILE`, pinned (`pinned`).

Everything is asked of the command line and read from the files that it leaves: what a user sees is what must not
change, and modules may move and be renamed below. This import is the only one of the package.
"""

from __future__ import annotations

import contextlib
import csv
import io
import json
import math
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from twin.cli.main import run as twin

TESTS = Path(__file__).parents[1]
NOISE = ("--noise", "0.05 K", "--tcp-noise", "0.3 um")
SIMULATED = ("--noise", "0.05 K", "--tcp-noise", "0.3 um")
# What the measured machine has otherwise than the described one.
CHANGES = {
    "slide": (
        ('resistance = "0.5 ohm"', 'resistance = "0.6 ohm"'),
        ('expansion = "10e-6 1/K"', 'expansion = "11e-6 1/K"'),
    ),
    "spindle": (
        ('diameter = "90 mm"', 'diameter = "95 mm"'),
        ('natural = "400 W/(m^2*K)"', 'natural = "320 W/(m^2*K)"'),
    ),
}
BUILD = {"slide": ("--states", 60, "--samples", 6, "--training", 4), "spindle": ()}
ONLY = {  # parameters that are fitted: every kind, not every one
    "slide": ("materials.cast_iron.*", "contacts.block.*", "contacts.x_*", "environment.*", "sources.*", "films.*"),
    "spindle": ("*",),
}
FREQUENCIES = (0.0, 1e-4, 1e-3, 1e-2)  # rad/s
# The state filter truncates its root every step, by eigenvectors of a squared matrix: after some 15 steps equal sums in
# another order differ by 1e-11, for parameters by 1e-8. So its first steps are compared as everything is, the whole run
# in parts of a scale so much larger, and of the parameters those of the first steps.
TRUNCATED = 1e3
BEGUN = 0.2  # of a run, for its first steps
FILM, JOINT = 8.0, 900.0  # W/(m^2*K), coefficients at which the artefact's matrices are summed

Values = dict[str, Any]  # name -> {"values": numbers, "scale": of its rounding}, or anything that must be equal


def numbers(values: Any, scale: float = 0.0) -> Values:
    """An array, compared relative to the larger of its largest number and `scale`."""
    array = np.asarray(values, dtype=float)
    finite = np.abs(array[np.isfinite(array)])
    listed = [None if math.isnan(v) else v for v in array.ravel().tolist()]
    return {"values": listed, "shape": list(array.shape), "scale": max(scale, float(finite.max(initial=0.0)))}


def command(*arguments: object, status: tuple[int, ...] = (0,)) -> None:
    """Run `twin ...`, silently."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        got = twin([str(a) for a in arguments])
    if got not in status:
        raise SystemExit(f"twin {' '.join(map(str, arguments))}: exit status {got}\n{out.getvalue()}")


def machine_values(name: str, folder: Path) -> Values:
    """Everything of one machine; `folder` takes its files."""
    machine = TESTS / "machines" / name
    (loads,) = (machine / "runs").iterdir()
    artefact, fitted = folder / "artefact.h5", folder / "fitted.h5"
    changed = _changed(machine, folder / "changed", CHANGES[name])
    measured, sealed = folder / "measured", folder / "sealed"
    command("build", machine, "-o", artefact, *BUILD[name], status=(0, 1))  # few states: above the limits
    for target, seed in ((measured, 1), (sealed, 2)):
        wanted = _with_rows(loads, folder / f"{target.name}_loads", backwards=target == sealed)
        command("simulate", changed, wanted, "-o", target, *SIMULATED, "--seed", seed)
    command("run", artefact, measured, "-o", folder / "result")
    only = [v for pattern in ONLY[name] for v in ("--only", pattern)]
    command("calibrate", artefact, measured, "-o", fitted, *NOISE, *only, "--budget", "10 h")
    command("score", fitted, measured, "--sealed", sealed, "-o", folder / "score")
    interval = ("--interval", "2 min", "--noise", "0.05 K")
    begun = _begun(measured, folder / "begun")
    for target, method, run in (("state", "state", measured), ("gain", "gain", measured), ("first", "state", begun)):
        command("update", artefact, run, "-o", folder / target, "--method", method, *interval)
    command("rtest", measured, "--artefact", artefact, "--sigma", "0.3 um", "--result", folder / "result",
            "-o", folder / "rtest")  # fmt: skip
    values = {
        "artefact": _artefact(artefact),
        "simulate": {p.name: _run_folder(p) for p in (measured, sealed)},
        "run": _result(folder / "result" / "result.h5"),
        "calibration": _calibration(fitted.with_suffix(".json")),
        "fitted": _artefact(fitted, FREQUENCIES[:1])["responses"],
        "score": _score(folder / "score" / "score.json"),
        "update": {
            "gain": _update(folder / "gain"),
            "state_at_first": _update(folder / "first"),
            "state": _update(folder / "state", TRUNCATED),
        },
        "rtest": _rtest(folder / "rtest" / "rtest.json"),
    }
    return dict(flat(values, name))


def example_values(folder: Path) -> Values:
    """R-tests of the shipped example, with balls known and unknown: five axes, two of them rotary."""
    found = {}
    for balls in ("known", "unknown"):
        command(
            "rtest",
            TESTS / "calibrate" / "r_tests",
            "--chain",
            "w-C-B-Z-b-X-Y-t",
            "--balls",
            balls,
            "-o",
            folder / balls,
        )
        found[balls] = _rtest(folder / balls / "rtest.json")
    return dict(flat(found, "r_tests"))


def flat(values: Values, name: str) -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        if isinstance(value, dict) and "values" not in value:
            yield from flat(value, f"{name}.{key}")
        else:
            yield f"{name}.{key}", value


def _changed(machine: Path, folder: Path, changes: tuple[tuple[str, str], ...]) -> Path:
    text = (machine / "machine.toml").read_text(encoding="utf-8")
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    folder.mkdir()
    (folder / "machine.toml").write_text(text, encoding="utf-8")
    return folder


def _with_rows(run: Path, folder: Path, backwards: bool) -> Path:
    """The run with two R-tests of 20 rows wanted, on a grid of positions; backwards: its loads in reversed order."""
    folder.mkdir()
    (folder / "run.toml").write_bytes((run / "run.toml").read_bytes())
    header, *rows = (run / "loads.csv").read_text(encoding="utf-8").splitlines()
    if backwards:
        times, rest = zip(*(row.split(",", 1) for row in rows), strict=True)
        rows = [f"{t},{r}" for t, r in zip(times, reversed(rest), strict=True)]
    (folder / "loads.csv").write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    last = float(rows[-1].split(",", 1)[0])
    wanted = [
        f"{share * last + 10 * k:g},{140 * math.sin(1.3 * k):.3f},0,0,0" for share in (0.1, 0.8) for k in range(20)
    ]
    (folder / "tcp.csv").write_text(
        "\n".join(["time [s],x [mm],dx [um],dy [um],dz [um]", *wanted]) + "\n", encoding="utf-8"
    )
    return folder


def _begun(run: Path, folder: Path) -> Path:
    """The first part of a run."""
    folder.mkdir()
    (folder / "run.toml").write_bytes((run / "run.toml").read_bytes())
    for name in ("loads.csv", "temperatures.csv", "tcp.csv"):
        header, *rows = (run / name).read_text(encoding="utf-8").splitlines()
        if name == "loads.csv":
            end = BEGUN * float(rows[-1].split(",", 1)[0])
        kept = [row for row in rows if float(row.split(",", 1)[0]) <= end]
        (folder / name).write_text("\n".join([header, *kept]) + "\n", encoding="utf-8")
    return folder


# --- what the files say ----------------------------------------------------------------------------------------------


def _artefact(path: Path, frequencies: tuple[float, ...] = FREQUENCIES) -> Values:
    """Certificate, and per body what no choice of coordinates changes: eigenvalues, masses, transfer functions."""
    values: dict[str, Any] = {"certificate": {}, "responses": {}}
    with h5py.File(path) as f:
        largest = {"temperature": 100.0, "displacement": 1e-4}  # K, m: errors are differences of numbers so large
        for name, data in f["certificate"].items():
            if name != "json" and not data.is_scale:
                scale = next((s for kind, s in largest.items() if kind in name), 0.0)
                values["certificate"][name] = numbers(data[...], scale)
        for name, body in f["bodies"].items():
            read = {key: data[...] for key, data in body.items() if isinstance(data, h5py.Dataset)}
            values["responses"][name] = _body(read, frequencies)
    return values


def _body(b: dict[str, np.ndarray], frequencies: tuple[float, ...]) -> Values:
    n = len(b["one"])
    films = b["M"].any(axis=0)  # joints have no column
    K = b["A0"] + sum((FILM if film else JOINT) * a for film, a in zip(films, b["A"], strict=True))
    inputs = np.hstack([b["B"], b["P"], b["M"] @ np.ones((b["M"].shape[1], 1)) / 1000.0])
    outputs = {"sensors": b["C"], "poses": b["G"].reshape(-1, n), "ports": b["P"].T, "films": b["M"].T}
    found: Values = {
        "states": n,
        "eigenvalues": numbers(np.sort(np.linalg.eigvals(np.linalg.solve(b["E"], K)).real)),
        "heat_of_one_kelvin": numbers(b["energy"] @ b["one"]),
    }
    for k, omega in enumerate(frequencies):
        x = np.linalg.solve(K + 1j * omega * b["E"], inputs[:, : 3 + len(b["B"].T)])
        for name, rows in outputs.items():
            y = rows @ x
            if y.size:
                found[f"{name}_at_{k}"] = numbers([y.real, y.imag])
    uniform = b["one"]
    found["share_of_films"] = numbers([uniform @ a @ uniform for a in b["A"]])
    if "E_members" in b:
        found["capacity_of_members"] = numbers([uniform @ e @ uniform for e in b["E_members"]])
    if "G_members" in b:
        found["expansion_of_members"] = numbers(b["G_members"] @ uniform)
    return found


def _run_folder(folder: Path) -> Values:
    values: Values = {}
    for name in ("temperatures", "tcp"):
        with (folder / f"{name}.csv").open(newline="", encoding="utf-8") as f:
            header, *rows = csv.reader(f)
        table = np.array(rows, dtype=float)
        values[name] = {"columns": header, **{h: numbers(c) for h, c in zip(header, table.T[:, ::4], strict=True)}}
    return values


def _result(path: Path) -> Values:
    with h5py.File(path) as f:
        values = {n: numbers(f[n][::6]) for n in ("temperature", "tcp_actual", "power", "film_heat", "film_coefficient",
                                                   "film_surface", "stored")}  # fmt: skip
        values["tcp"] = numbers(f["tcp"][::15])
        values["balance_error"] = numbers(f["balance_error"][...].max(), 1.0)
        values["flags"] = f["flags"][...].sum(axis=0).tolist()
    return values


def _calibration(path: Path) -> Values:
    told = json.loads(path.read_text(encoding="utf-8"))
    return {
        "stopped": told["stopped"],
        "parameters": {
            row["path"]: {
                "fit": numbers([row["value"], row["sigma"]]),
                "prior": numbers([row["pull"], row["learned"]], 1.0),
            }
            for row in told["parameters"]
        },
        "cost": numbers(told["cost"][-1]["cost"]),
        "runs": {
            run["name"]: numbers([run["rms_temperature_K"], 1e4 * run["rms_displacement_m"]]) for run in told["runs"]
        },
        "correlation": numbers(np.array(told["correlation"])[:6]),
        "not_separated": told["not_separated"],
        "window": numbers([told["window_model"]["states"], told["window_model"]["rms_temperature_K"]]),
    }


def _score(path: Path) -> Values:
    """Figures of the model and of what needs no iteration: the fits of ARX and OE stop at 1e-8, or see too little."""
    told = json.loads(path.read_text(encoding="utf-8"))
    measures = ("rms", "max_abs", "mean", "p2p", "measured_rms")
    values: Values = {}
    for row in told["figures"]:
        if row["method"] in ("ARX", "OE"):
            continue
        name = "/".join(row[k] for k in ("part", "segment", "output", "method"))
        values[name] = numbers([math.nan if row[m] is None else row[m] for m in measures])
    for part, best in told["model_minus_best_baseline"].items():
        between = best["interval_95_m"] or []
        values[f"{part}/best"] = {"name": best["baseline"], "rms": numbers([best["rms_difference_m"], *between])}
    return values


def _update(folder: Path, factor: float = 1.0) -> Values:
    """Predicted and corrected series; factor: of the scales, other than one without parameters."""
    with h5py.File(folder / "update.h5") as f:
        tcp = float(np.abs(f["measured"][...]).max())
        values: Values = {n: numbers(f[n][::3], tcp * factor) for n in ("tcp", "sigma", "predicted", "predicted_sigma")}
        values["correction"] = numbers(f["correction"][::10], tcp * factor)
        values["used"] = int(f["used"][...].sum())
        values["accepted"] = int(f["told_accepted"][...].sum())
        of_tcp = np.isin(f["told_name"].asstr()[...], ("dx", "dy", "dz"))
        for kind, rows, scale in (("tcp", of_tcp, tcp), ("sensors", ~of_tcp, 20.0)):
            if rows.any():
                values[f"innovation_of_{kind}"] = numbers(f["told_innovation"][...][rows][::8], scale * factor)
    told = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    values["coverage"] = told["coverage_95"]
    if factor == 1.0:
        values["parameters"] = {name: numbers(pair) for name, pair in told.get("parameters", {}).items()}
    return values


def _rtest(path: Path) -> Values:
    told = json.loads(path.read_text(encoding="utf-8"))
    return {f"measurement_{m['number']}": dict(_leaves(m)) for m in told["measurements"]}


def _leaves(tree: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Numbers of a JSON tree by path; metres and radians have a scale of 1e-5 at least, others of 1."""
    if isinstance(tree, dict):
        for key, value in tree.items():
            yield from _leaves(value, f"{name}/{key}" if name else key)
    elif isinstance(tree, list) and tree and all(isinstance(v, dict) for v in tree):
        for k, value in enumerate(tree):
            yield from _leaves(value, f"{name}/{k}")
    elif isinstance(tree, float) or (isinstance(tree, list) and any(isinstance(v, float) for v in tree)):
        listed = [tree] if isinstance(tree, float) else tree
        small = name.rsplit("/", 1)[-1].endswith(("_m", "_rad", "value", "sigma"))
        yield name, numbers([math.nan if v is None else v for v in listed], 1e-5 if small else 1.0)
    else:
        yield name, tree


def main(target: str) -> None:
    os.environ["TWIN_SOLVER"] = "superlu"  # these machines are small: without MKL there is one source of digits less
    with tempfile.TemporaryDirectory() as temporary:
        values: Values = {}
        for name in CHANGES:
            folder = Path(temporary) / name
            folder.mkdir()
            values |= machine_values(name, folder)
        values |= example_values(Path(temporary))
    Path(target).write_text(json.dumps(values), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
