"""twin rtest: single axis errors of the linear axes from R-tests."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np

    from twin.calibrate.axis_errors.chain import Chain
    from twin.calibrate.axis_errors.rtest import Measurement, Readings
    from twin.calibrate.axis_errors.rtest_model import ModelErrors


@click.command(epilog="Example: twin rtest tests/calibrate/r_tests --chain w-C-B-Z-b-X-Y-t --at '2 h'")
@click.argument("run", type=click.Path())
@click.option("--chain", help="axes from workpiece over bed to tool, e.g. w-C-B-Z-b-X-Y-t; Z' where positive positions "
              "move what it carries against the machine coordinate  [default: that of --artefact]")  # fmt: skip
@click.option("--artefact", type=click.Path(), help="take the chain from this machine")
@click.option("--balls", type=click.Choice(["known", "unknown"]), default="known", show_default=True,
              help="unknown: an offset of each placing is fitted too; needs columns b [deg], c [deg]")  # fmt: skip
@click.option("--gap", default="10 min", show_default=True, help="longer breaks divide measurements")
@click.option("--at", help="only the measurement nearest this time, e.g. '4 h'")
@click.option("--sigma", help="standard deviation of each reading  [default: that in tcp.csv, else of the residuals]")
@click.option(
    "--result", type=click.Path(), help="of `twin run`: the same errors of the model beside the measured ones"
)
@click.option("-o", "--output", type=click.Path(), help="folder for axis_errors.csv and rtest.json")
@click.option("--json", "as_json", is_flag=True, help="machine-readable")
def command(
    run: str, chain: str | None, artefact: str | None, balls: str, gap: str, at: str | None, sigma: str | None,
    result: str | None, output: str | None, as_json: bool,
) -> None:  # fmt: skip
    """Find single axis errors (ISO 230-1) of the linear axes from the R-tests in tcp.csv of RUN.

    Every measurement by itself: the errors at the end of the ranges with their standard deviations, those that it
    cannot show, the shift of the tool against the workpiece, and whether the residuals fit the noise. With --result
    also how much of the computed volumetric error is axis errors.
    """
    import json
    from pathlib import Path

    from twin.atomic import check_folder
    from twin.calibrate.axis_errors.rtest import measurements, readings
    from twin.calibrate.axis_errors.rtest_model import model_errors, read_pose_history
    from twin.cli.quantity import option, positive
    from twin.cli.rtest_text import text
    from twin.errors import TwinError
    from twin.logs.read import read_run
    from twin.run.results import refuse_run_folder

    pause = positive("--gap", gap, "s")
    noise = None if sigma is None else positive("--sigma", sigma, "m")
    wanted = None if at is None else option("--at", at, "s")
    if output is not None:
        check_folder(Path(output))
        refuse_run_folder(Path(output))
    axes = _chain(chain, artefact)
    logged = read_run(Path(run))
    read = readings(logged, axes, noise)
    found = measurements(read, axes, pause, balls == "known")
    models: tuple[ModelErrors | None, ...] = (None,) * len(found)
    if result is not None:
        models = model_errors(read_pose_history(Path(result)), axes, read, found)
    facts = [_facts(k, m, model) for k, (m, model) in enumerate(zip(found, models, strict=True), start=1)]
    if wanted is not None:
        fitted = [f for f in facts if "errors" in f]
        facts = [min(fitted, key=lambda f: abs(f["start_s"] - wanted))]
        if not read.time[0] - pause <= wanted <= read.time[-1] + pause:
            what = f"measurements are from {read.time[0] / 3600:.2f} h to {read.time[-1] / 3600:.2f} h"
            raise TwinError(what, "--at", f"write a time within, for example --at '{facts[0]['start_s'] / 3600:.2f} h'")
    told: dict[str, Any] = {
        "run": run,
        "chain": str(axes),
        "balls": balls,
        "ranges_m": _ranges(axes, read),
        "rows_left_out": read.dropped,
        "tcp_reference": logged.tcp_reference,
        "where": "errors are those at the end of the ranges, from their middle; tool minus workpiece counts positive",
        "measurements": facts,
    }
    if output is not None:
        _write(Path(output), told)
    click.echo(json.dumps(told, indent=2) if as_json else text(told))


def _chain(text: str | None, artefact: str | None) -> Chain:
    from pathlib import Path

    from twin.calibrate.axis_errors.chain import EXAMPLE, chain_of, parse_chain
    from twin.errors import TwinError
    from twin.rom.artefact import read_artefact

    if text is not None:
        return parse_chain(text)
    if artefact is None:
        raise TwinError(
            "which axes carry the tool is not known", "--chain", f"write --chain {EXAMPLE}, or --artefact A.h5"
        )
    return chain_of(read_artefact(Path(artefact)))


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


def _write(folder: Path, told: dict[str, Any]) -> None:
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
