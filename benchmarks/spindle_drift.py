"""A lumped twin from measured data alone: three speeds of a real spindle fitted, the fourth predicted.

Needs the measured data (TWIN_MEASURED_DATA) and says so where there are none. Nothing of the scored hours enters a fit.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

import numpy as np

from models.measured import VARIABLE, measured_data
from models.scripts import load_script
from twin.calibrate.score.bootstrap import Difference, rms_difference
from twin.calibrate.score.compare import channels
from twin.calibrate.transfer_function.identify import Method, identify
from twin.cli.main import run as command
from twin.errors import ModelError
from twin.logs.read import read_run
from twin.rom.artefact import read_artefact
from twin.run.replay import replay

ROOT = Path(__file__).parents[1]
MODEL = ROOT / "models" / "spindle_drift"
OUT = ROOT / "out" / "spindle_drift"
AXES = {"dx": "ch1", "dy": "ch3", "dz": "ch5"}
# rms [um] that came with the data, of hours 24 to 46: other hours than here, so of the same size at best
GIVEN = {"spindle only": (3.3, 15.2, 9.4), "spindle and air": (1.5, 7.4, 36.0), "16 sensors": (4.6, 7.0, 8.1)}
GRID = 120.0  # s, of transfer functions


def main() -> None:
    data = measured_data("spindle_drift")
    if data is None:
        print(f"   not run: no measured data; set {VARIABLE} to the folder that holds spindle_drift")
        return
    script = load_script(MODEL, "baselines.py")
    table = script.recording(data / "warmup")
    test = table.hour > script.HOURS[-1][1]
    measured = {c: table.channels[c][test] for c in AXES.values()}
    model = residuals(data / "warmup")
    found = script.baselines(table)
    others = {(b.name, b.chosen): {c: b.predicted[c] - measured[c] for c in measured} for b in found}
    for method in ("arx", "oe"):
        others[f"{method.upper()} of speed and air", ""] = transfer(script, table, method)
    print_table(model, others)
    for how in sorted({b.chosen for b in found if b.chosen}):
        told = [min((b.validation[c], b.name) for b in found if b.chosen == how)[1] for c in measured]
        values = [rms(others[name, how][c]) for name, c in zip(told, measured, strict=True)]
        print(f"   {'kind chosen, too: ' + how:48}" + "".join(f"{v:22.2f}" for v in values))


def residuals(data: Path) -> Mapping[str, np.ndarray]:
    """Of the calibrated twin on the sealed run: channel -> (m,) um, computed minus measured."""
    load_script(MODEL / "runs", "make_runs.py").write_runs(data, OUT)
    rough, fitted = OUT / "rough.h5", OUT / "calibrated.h5"
    for arguments in (
        ["build", str(MODEL), "-o", str(rough)],
        ["calibrate", str(rough), str(OUT / "training"), "-o", str(fitted), "--iterations", "100"],
    ):
        told = io.StringIO()
        with contextlib.redirect_stdout(told), contextlib.redirect_stderr(told):
            status = command(arguments)
        if status:
            raise SystemExit(told.getvalue())
    artefact, sealed = read_artefact(fitted), read_run(OUT / "sealed")
    found = {c.name: c for c in channels(artefact, sealed, replay(artefact, sealed)) if c.kind == "tcp"}
    return {channel: 1e6 * (found[axis].simulated - found[axis].measured) for axis, channel in AXES.items()}


def transfer(script: ModuleType, table, method: Method) -> dict[str, np.ndarray]:  # type: ignore[no-untyped-def]
    """Transfer functions of paper 003 from speed, whether it turns, and the air; order by held-out training hours."""
    step = round(GRID / 3600.0 / (table.hour[1] - table.hour[0]))
    few, test = slice(None, None, step), table.hour > script.HOURS[-1][1]
    air = table.sensors[:, 3] - table.sensors[0, 3]
    u = np.column_stack([table.speed / 5000.0, (table.speed > 0.0).astype(float), air])[few]
    learn = table.hour[few] <= script.HOURS[-1][1]
    result = {}
    for c in AXES.values():
        y = table.channels[c] - table.channels[c][0]
        try:
            found = identify(u, np.where(learn, y[few], np.nan), GRID, method)
        except ModelError:
            result[c] = np.full(int(test.sum()), np.nan)
            continue
        result[c] = (np.interp(table.hour, table.hour[few], found(u)) - y)[test]
    return result


def print_table(model: Mapping[str, np.ndarray], others: Mapping[tuple[str, str], Mapping[str, np.ndarray]]) -> None:
    names = list(AXES.values())
    print(f"   {'rms [um] of hours 24 to 32':48}" + "".join(f"{c:>22}" for c in names))
    for (name, how), r in others.items():
        print(f"   {name:24}{how:24}" + "".join(f"{rms(r[c]):22.2f}" for c in names))
    print(f"   {'twin, calibrated on hours 0 to 24':48}" + "".join(f"{rms(model[c]):22.2f}" for c in names))
    own = [interval(rms_difference([np.abs(model[c])], [np.zeros_like(model[c])])) for c in names]
    print(f"   {'  95 % interval':48}" + "".join(f"{text:>22}" for text in own))
    best = {c: min((rms(r[c]), key) for key, r in others.items() if np.isfinite(r[c]).all())[1] for c in names}
    differences = [rms_difference([np.abs(model[c])], [np.abs(others[best[c]][c])]) for c in names]
    print(f"   {'  minus the best baseline, in hindsight':48}" + "".join(f"{d.value:+22.2f}" for d in differences))
    print(f"   {'  95 % interval':48}" + "".join(f"{interval(d):>22}" for d in differences))
    for c, d in zip(names, differences, strict=True):
        print(f"   {c}: {'better' if d.value < 0 else 'WORSE'} than {' '.join(best[c]).strip()}")
    print("   given with the data, of hours 24 to 46:")
    for name, values in GIVEN.items():
        print(f"   {name:48}" + "".join(f"{v:22.1f}" for v in values))


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def interval(d: Difference) -> str:
    return "too few blocks" if d.low is None else f"{d.low:.2f} .. {d.high:.2f}"


if __name__ == "__main__":
    main()
