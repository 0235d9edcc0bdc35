"""A rough twin of a real lathe calibrated: what weights are worth.

Needs the measured data (TWIN_MEASURED_DATA) and says so where there are none. The six days of models/lathe/README.md
are fitted with and without weights (docs/calibration.md), as measured and with a channel that is wrong by less than the
judgement of channels sees; eight other days are predicted. How far a damaged channel moves parameters
`benchmarks.lathe_damaged` tells.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.lathe_diagnosis import MODEL, TRAINING
from models.measured import VARIABLE, measured_data
from models.recordings import lathe_days
from models.scripts import load_script
from twin.build.product import build_artefact
from twin.calibrate.channels.judge import judge, set_aside
from twin.calibrate.fit.calibration import calibrate, chosen
from twin.calibrate.fit.fit import Fit
from twin.calibrate.fit.options import Options
from twin.calibrate.fit.product import calibrated
from twin.calibrate.score.compare import channels
from twin.inject.damage.channels import Damage
from twin.inject.damage.kinds import damaged
from twin.logs.read import read_run
from twin.logs.run import Run
from twin.rom.artefact import Artefact, read_artefact
from twin.run.replay import replay

OUT = Path(__file__).parents[1] / "out" / "lathe_calibration"
SEALED = 8
HIDDEN = Damage("sensor", "sensors.PT08", 1.4, "offset")  # K: a channel is refuted from 1.5 K on


def main() -> None:
    data = measured_data("lathe")
    if data is None:
        print(f"   not run: no measured data; set {VARIABLE} to the folder that holds lathe")
        return
    OUT.mkdir(parents=True, exist_ok=True)
    with contextlib.redirect_stdout(io.StringIO()):
        load_script(MODEL / "runs", "make_runs.py").write_runs(data, OUT / "runs")
        if not (OUT / "rough.h5").exists():
            build_artefact(MODEL / "machine.toml", OUT / "rough.h5")
    artefact = read_artefact(OUT / "rough.h5")
    training = [_run(day) for day in TRAINING]
    others = [p.stem for p in lathe_days() if p.stem not in TRAINING and p.stem != "20200706"]
    sealed = [_run(day) for day in others[: 2 * SEALED : 2]]
    print(f"   rms of {len(sealed)} sealed days{'':34}all sensors [K]   dx, dz [um]")
    for name, runs in (
        ("days as measured", training),
        (
            f"one sensor {HIDDEN.size:g} K off in two of the days",
            [damaged(r, HIDDEN) for r in training[:2]] + training[2:],
        ),
    ):
        for weighted in (True, False):
            fit = fitted(artefact, runs, weighted)
            left = np.array([left_by(artefact, fit, run) for run in sealed])
            T, x, z = np.sqrt(np.mean(left**2, axis=0))
            print(
                f"   {name + (', weights' if weighted else ', no weights'):58}{T:8.3f}{1e6 * x:14.2f}{1e6 * z:8.2f}",
                flush=True,
            )


def fitted(artefact: Artefact, runs: Sequence[Run], weighted: bool) -> Fit:
    """As `twin calibrate` fits, channels judged first."""
    sound = set_aside(runs, judge(runs).findings)
    return calibrate(artefact, sound, chosen(artefact), Options(weights=weighted)).fit


def left_by(artefact: Artefact, fit: Fit, run: Run) -> tuple[float, float, float]:
    """rms of all sensors [K] and of dx and dz [m] that the fitted twin leaves of a run."""
    model, parameters = calibrated(artefact, fit.problem.parameters, fit.problem.values(fit.x))
    own = replace(artefact, model=model, parameters=parameters)
    air = {name for name, _ in model.ambient_sensors}
    errors: dict[str, list[np.ndarray]] = {}
    for c in channels(own, run, replay(own, run, 60.0)):
        if c.name not in air:
            errors.setdefault(c.name if c.kind == "tcp" else "T", []).append(c.measured - c.simulated)
    T, x, z = (float(np.sqrt(np.mean(np.concatenate(errors[k]) ** 2))) for k in ("T", "dx", "dz"))
    return T, x, z


def _run(day: str) -> Run:
    return replace(read_run(OUT / "runs" / day), provenance=day)


if __name__ == "__main__":
    main()
