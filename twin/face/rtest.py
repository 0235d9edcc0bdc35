"""Single axis errors (ISO 230-1) of the linear axes from R-tests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from twin.errors import TwinError
from twin.face.inputs import Quantity, name_of, positive, quantity, run_of

if TYPE_CHECKING:
    import numpy as np

    from twin.calibrate.axis_errors.chain import Chain
    from twin.calibrate.axis_errors.rtest import Measurement, Readings
    from twin.calibrate.axis_errors.rtest_model import ModelErrors
    from twin.face.model import Model
    from twin.logs.run import Run


@dataclass(frozen=True)
class RTestOptions:
    """How measurements are distinguished and fitted."""

    balls: Literal["known", "unknown"] = "known"  # unknown: an offset of each placing is fitted too
    gap: Quantity = "10 min"  # longer breaks divide measurements
    sigma: Quantity | None = None  # of each reading; by default that in tcp.csv, else of the residuals


@dataclass(frozen=True)
class AxisErrors:
    """The axis errors of each measurement."""

    facts: Mapping[str, Any] = field(repr=False)  # what rtest.json holds; SI

    @property
    def measurements(self) -> list[dict[str, float]]:
        """Of each measurement with enough rows: the determined errors by name ("EXX"), m and rad."""
        return [
            {name: error["value"] for name, error in m["determined"].items()}
            for m in self.facts["measurements"]
            if "determined" in m
        ]

    def save(self, folder: str | Path) -> None:
        """Write axis_errors.csv and rtest.json."""
        _write(Path(folder), self.facts)


def rtest(
    run: Run | str | Path,
    chain: str | None = None,
    model: Model | str | Path | None = None,
    at: Quantity | None = None,
    result: str | Path | None = None,
    options: RTestOptions | None = None,
    output: str | Path | None = None,
) -> AxisErrors:
    """Find single axis errors of the linear axes from the R-tests in tcp.csv of a run.

    chain: axes from workpiece over bed to tool, "w-C-B-Z-b-X-Y-t"; by default that of `model`. at: only the measurement
    nearest this time. result: folder of a `twin.run`, to find the same errors of the model. output: folder to write.
    Raises LogError for runs without enough rows, TwinError where the chain is not known.

    >>> import twin
    >>> found = twin.rtest("tests/calibrate/r_tests", "w-C-B-Z-b-X-Y-t", at="2 h")
    >>> len(found.measurements), len(found.measurements[0])
    (1, 15)
    >>> f"{1e6 * found.measurements[0]['EXX']:.0f} um"  # positioning error of X at the end of its range
    '-16 um'
    """
    from twin.atomic import check_folder
    from twin.calibrate.axis_errors.rtest import measurements, readings
    from twin.calibrate.axis_errors.rtest_model import model_errors, read_pose_history
    from twin.run.results import refuse_run_folder

    o = options or RTestOptions()
    pause = positive("gap", o.gap, "s")
    noise = None if o.sigma is None else positive("sigma", o.sigma, "m")
    wanted = None if at is None else quantity("at", at, "s")
    if output is not None:
        check_folder(Path(output))
        refuse_run_folder(Path(output))
    axes = _chain(chain, model)
    logged = run_of(run)
    read = readings(logged, axes, noise)
    found = measurements(read, axes, pause, o.balls == "known")
    models: tuple[ModelErrors | None, ...] = (None,) * len(found)
    if result is not None:
        models = model_errors(read_pose_history(Path(result)), axes, read, found)
    facts = [_facts(k, m, of_model) for k, (m, of_model) in enumerate(zip(found, models, strict=True), start=1)]
    axis_errors = AxisErrors(
        {
            "run": name_of(run),
            "chain": str(axes),
            "balls": o.balls,
            "ranges_m": _ranges(axes, read),
            "rows_left_out": read.dropped,
            "tcp_reference": logged.tcp_reference,
            "where": "errors are those at the end of the ranges, from their middle; tool minus workpiece counts "
            "positive",
            "measurements": facts if wanted is None else [_nearest(facts, wanted, read, pause)],
        }
    )
    if output is not None:
        axis_errors.save(output)
    return axis_errors


def _nearest(facts: list[dict[str, Any]], wanted: float, read: Readings, pause: float) -> dict[str, Any]:
    """The fitted measurement nearest a time [s]. Raises TwinError for times outside the measurements."""
    nearest = min((f for f in facts if "errors" in f), key=lambda f: abs(f["start_s"] - wanted))
    if not read.time[0] - pause <= wanted <= read.time[-1] + pause:
        what = f"measurements are from {read.time[0] / 3600:.2f} h to {read.time[-1] / 3600:.2f} h"
        raise TwinError(what, "--at", f"write a time within, for example --at '{nearest['start_s'] / 3600:.2f} h'")
    return nearest


def _chain(text: str | None, model: Model | str | Path | None) -> Chain:
    from twin.calibrate.axis_errors.chain import EXAMPLE, chain_of, parse_chain
    from twin.face.model import read
    from twin.face.still import refuse_still

    if text is not None:
        return parse_chain(text)
    if model is None:
        raise TwinError(
            "which axes carry the tool is not known", "--chain", f"write --chain {EXAMPLE}, or --artefact A.h5"
        )
    artefact = read(model).artefact
    refuse_still(artefact.model)
    return chain_of(artefact)


def _ranges(chain: Chain, read: Readings) -> dict[str, list[float]]:
    return {
        axis.letter: [float(read.position[:, k].min()), float(read.position[:, k].max())]
        for k, axis in enumerate(chain.linear)
    }


def _facts(number: int, measurement: Measurement, model: ModelErrors | None) -> dict[str, Any]:
    """One measurement as JSON values: SI units in the names."""
    time, fit = measurement.readings.time, measurement.fit
    told: dict[str, Any] = {
        "number": number,
        "start_s": float(time[0]),
        "end_s": float(time[-1]),
        "rows": len(time),
        "rows_needed": measurement.needed,
        "deviation_rms_m": measurement.rms.tolist(),
    }
    if fit is None:
        return told
    told |= {
        "errors": len(fit.names),
        "rank": fit.rank,
        "determined": {
            name: {"value": value, "sigma": sigma, "unit": unit}
            for name, value, sigma, unit, known in zip(
                fit.names, fit.value.tolist(), fit.sigma.tolist(), fit.units, fit.determined, strict=True
            )
            if known
        },
        "not_determined": [n for n, known in zip(fit.names, fit.determined, strict=True) if not known],
        "hidden": [c.weights for c in fit.hidden],
        "seen_only_together": [
            {"weights": c.weights, "text": str(c), "value_m": c.value, "sigma_m": c.sigma} for c in fit.visible
        ],
        "hidden_text": [str(c) for c in fit.hidden],
        "shift_m": _finite(fit.shift),
        "shift_sigma_m": _finite(fit.shift_sigma),
        "tilt_rad": _finite(fit.tilt),
        "tilt_sigma_rad": _finite(fit.tilt_sigma),
        "residual_rms_m": fit.rms,
        "noise_m": fit.noise,
        "misfit": fit.misfit,
    }
    if model is not None:
        shares = model.shares
        told["model"] = {
            "errors": model.fit.values(),
            "shift_m": _finite(model.fit.shift),
            "tilt_rad": _finite(model.fit.tilt),
            "residual_rms_m": model.fit.rms,
            "rows_outside_the_poses": model.outside,
            "volume": {
                "shift": shares.shift,
                "tilt": shares.tilt,
                "axis_errors": shares.axis_errors,
                "rest": shares.rest,
                "largest_m": shares.largest,
                "largest_rest_m": shares.largest_rest,
            },
        }
    return told


def _finite(values: np.ndarray) -> list[float | None]:
    """JSON knows no NaN."""
    return [v if v == v else None for v in values.tolist()]


def _write(folder: Path, told: Mapping[str, Any]) -> None:
    import json

    import numpy as np

    from twin.atomic import atomic_path
    from twin.logs.run import Table
    from twin.logs.write import write_table

    facts = [f for f in told["measurements"] if "errors" in f]
    columns, units = {}, {}
    for name in dict.fromkeys(n for f in facts for n in f["determined"]):
        entries = [f["determined"].get(name, {}) for f in facts]
        for column, key in ((name, "value"), (f"{name}_sigma", "sigma")):
            columns[column] = np.array([e.get(key, np.nan) for e in entries])
            units[column] = next(e["unit"] for e in entries if e)
    with atomic_path(folder / "axis_errors.csv") as path:
        write_table(path, Table(np.array([f["start_s"] for f in facts]), columns, units))
    with atomic_path(folder / "rtest.json") as path:
        path.write_text(json.dumps(told, indent=2) + "\n", encoding="utf-8")
