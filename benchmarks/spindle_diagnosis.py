"""What `twin diagnose` says about a real spindle whose twin knows the spindle's own heat and one air, nothing else.

Needs the measured data (TWIN_MEASURED_DATA) and says so where there are none. The sealed hours are the fourth speed.
"""

from __future__ import annotations

import contextlib
import io
import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from models.measured import VARIABLE, measured_data
from models.scripts import load_script
from twin.cli.main import run as command
from twin.logs.read import read_run
from twin.logs.write import write_run

ROOT = Path(__file__).parents[1]
MODEL = ROOT / "models" / "spindle_drift"
OUT = ROOT / "out" / "spindle_diagnosis"
CHANNELS = {"dx": "ch1", "dy": "ch3", "dz": "ch5"}
RANKED = 6


def main() -> None:
    data = measured_data("spindle_drift")
    if data is None:
        print(f"   not run: no measured data; set {VARIABLE} to the folder that holds spindle_drift")
        return
    write_runs(data / "warmup")
    start, calibrated = OUT / "start.h5", OUT / "calibrated.h5"
    told("build", MODEL / "spindle_only.toml", "-o", start)
    told("calibrate", start, OUT / "training", "-o", calibrated, "--iterations", 100)
    for name, artefact in (("calibrated", calibrated), ("as_guessed", start)):
        folder = OUT / name
        lines = told("diagnose", artefact, OUT / "training", "--sealed", OUT / "sealed", "-o", folder)
        print(f"   -- the twin {name.replace('_', ' ')}; {(folder / 'index.html').relative_to(ROOT)}")
        first = next(i for i, line in enumerate(lines) if line.startswith("spindle_only:"))
        print("".join(f"   {line}\n" for line in lines[first:] if not line.startswith("Note")), end="")
        print_report(json.loads((folder / "report.json").read_text(encoding="utf-8")))


def write_runs(data: Path) -> None:
    """As for `spindle_drift`, without what that benchmark says of the machine: it begins as warm as t4, and a row of
    displacements is as good as `--tcp-noise` says."""
    load_script(MODEL / "runs", "make_runs.py").write_runs(data, OUT / "as_calibrated")
    for name in ("training", "sealed"):
        run = read_run(OUT / "as_calibrated" / name)
        assert run.tcp is not None
        shutil.rmtree(OUT / name, ignore_errors=True)  # a copy of the last time; measured runs are never written over
        write_run(OUT / name, replace(run, initial_temperature=None, tcp=replace(run.tcp, sigma=None)))


def told(*arguments: object) -> Sequence[str]:
    """What a command prints. Raises SystemExit where it fails."""
    said, aside = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(aside):
        status = command([str(a) for a in arguments])
    if status:
        raise SystemExit(said.getvalue() + aside.getvalue())
    return said.getvalue().splitlines()


def print_report(report: Mapping[str, Any]) -> None:
    print(f"   {'best candidates':72}{'statistic':>10}{'needed':>9}")
    for r in report["ranked"][:RANKED]:
        text = f"{r['family']} at {r['place']}, {r['history']}: {r['amplitude']:.3g} {r['unit']}"
        print(f"   {text:72}{r['statistic']:10.1f}{report['thresholds'][r['family']]:9.1f}")
    print(f"   {'rms [um] of hours 24 to 32':32}{'delivered':>11}{'calibrated':>12}{'extended':>10}{'gain, 95 %':>20}")
    for g in report["gain"]:
        low, high = (1e6 * v for v in g["ci95"])
        rms = [1e6 * g[kind] for kind in ("delivered", "recalibrated", "extended")]
        name = CHANNELS.get(g["channel"], g["channel"])
        print(f"   {name:32}{rms[0]:11.1f}{rms[1]:12.1f}{rms[2]:10.1f}{f'{low:+.1f} .. {high:+.1f}':>20}")


if __name__ == "__main__":
    main()
