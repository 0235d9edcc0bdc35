"""twin update: a run in which sparse TCP measurements correct the model."""

from __future__ import annotations

from typing import Any

import click


@click.command(epilog="Example: twin update out/five_axis.h5 out/truth --interval '1 h' -o out/update")
@click.argument("artefact", type=click.Path())
@click.argument("run", type=click.Path())
@click.option("--method", type=click.Choice(["state", "gain", "paper"]), default="state", show_default=True,
              help="Kalman filter on thermal state and parameters, with all sensors; bounded gain and offset per axis; "
              "or the gain of paper 003 as printed")  # fmt: skip
@click.option("--interval", help="use a TCP measurement this often, e.g. '30 min'; the others are only predicted  "
              "[default: as measured]")  # fmt: skip
@click.option("--tolerance", help="let a scheduler ask for measurements so that the standard deviation of the error "
              "stays below this, e.g. '3 um'; the row that follows a request is used")  # fmt: skip
@click.option("--earlier", multiple=True, type=click.Path(), help="a run measured before, from which to learn how far "
              "the model may be off where no parameter explains it (method state; may be repeated)")  # fmt: skip
@click.option("--slew", default="5 um", show_default=True, help="most by which the correction moves in a minute")
@click.option("--tcp-noise", default="1 um", show_default=True, help="of TCP measurements without a sigma")
@click.option("--sensor-noise", default="0.1 K", show_default=True, help="of a temperature reading")
@click.option("--dt", default="60 s", show_default=True, help="time step")
@click.option("-o", "--output", type=click.Path(), help="folder for update.h5, tcp.csv, summary.json, state")
@click.option("--json", "as_json", is_flag=True, help="print the summary as JSON")
def command(
    artefact: str,
    run: str,
    method: str,
    interval: str | None,
    tolerance: str | None,
    earlier: tuple[str, ...],
    slew: str,
    tcp_noise: str,
    sensor_noise: str,
    dt: str,
    output: str | None,
    as_json: bool,
) -> None:
    """Live through RUN with the model of ARTEFACT as beside the machine: what is measured corrects what follows.

    Every row of the run's tcp.csv is predicted before it is used. The model itself stays as it is; the correction is
    kept beside it, with the standard deviation of what it leaves.
    """
    from twin.calibrate.update.methods import Options, learnt, update_run  # isort: skip  first: it prepares JAX

    import json
    from pathlib import Path

    from twin import __version__
    from twin.atomic import check_folder
    from twin.calibrate.update.files import summary, write_update
    from twin.calibrate.update.live import write_live
    from twin.calibrate.update.plan import Plan
    from twin.calibrate.update.schedule import Schedule
    from twin.calibrate.update.tune import tune
    from twin.cli.quantity import positive
    from twin.errors import TwinError
    from twin.logs.read import read_run
    from twin.progress import bar, silent
    from twin.rom.artefact import read_artefact
    from twin.run.results import refuse_run_folder

    if interval is not None and tolerance is not None:
        raise TwinError("give one of --interval and --tolerance", "--tolerance", "leave one of them away")
    if tolerance is not None and method == "paper":
        raise TwinError("the method of the paper predicts no uncertainty", "--tolerance", "choose another --method")
    step, noise = positive("--dt", dt, "s"), positive("--tcp-noise", tcp_noise, "m")
    options = Options(
        method=method,  # type: ignore[arg-type]
        dt=step,
        slew=positive("--slew", slew, "m") / 60.0,
        tcp_noise=noise,
        sensor_noise=positive("--sensor-noise", sensor_noise, "delta_degC"),
    )
    plan = Plan(
        None if interval is None else positive("--interval", interval, "s"),
        None if tolerance is None else Schedule(positive("--tolerance", tolerance, "m")),
    )
    if earlier and method != "state":
        raise TwinError(f"the method {method} has nothing to learn from earlier runs", "--earlier", "leave it away")
    if output is not None:
        check_folder(Path(output))
        refuse_run_folder(Path(output))
    loaded = read_artefact(Path(artefact))
    progress = silent if as_json else bar
    tuned = tune(loaded, [read_run(Path(r)) for r in earlier], options, progress=progress) if earlier else None
    options = options if tuned is None else tuned.options
    measured = read_run(Path(run))
    updated, live, program = update_run(loaded, measured, options, plan, progress)
    known = {*loaded.model.sensors, *(name for name, _ in loaded.model.ambient_sensors)}
    columns = measured.temperatures.columns if measured.temperatures is not None else ()
    facts: dict[str, Any] = {
        "machine": loaded.model.name,
        "artefact": artefact,
        "model_sha256": loaded.digest,
        "run": run,
        "pose_axes": list(loaded.model.pose_axes),
        "unknown_sensors": sorted(set(columns) - known),
        "rows_left_out": (0 if measured.tcp is None else len(measured.tcp.time)) - len(updated.row_time),
        "twin": __version__,
    }
    if tuned is not None:
        facts["discrepancy"] = {"factor": tuned.factor, "log_likelihood": [list(t) for t in tuned.log_likelihood]}
    if method == "state":
        facts["parameters"] = learnt(loaded, live)
    told = {**facts, **summary(updated, noise)}
    if output is not None:
        write_update(Path(output), updated, facts, noise)
        write_live(Path(output), program, live)
    click.echo(json.dumps(told, indent=2) if as_json else "\n".join(_lines(told)))


def _lines(told: dict[str, Any]) -> list[str]:
    """The summary for people."""
    lines = [
        f"{told['machine']}, method {told['method']}: {told['used']} of {told['rows']} TCP measurements used; "
        f"largest correction {1e6 * max(told['largest_correction_m']):.1f} um, "
        f"by at most {1e6 * told['largest_step_of_correction_m']:.2f} um a step"
    ]
    if "discrepancy" in told:
        lines.append(
            f"earlier runs are most likely with {told['discrepancy']['factor']:g} times the prior discrepancies"
        )
    if told["unknown_sensors"]:
        lines.append(f"not sensors of the machine: {', '.join(told['unknown_sensors'])}")
    if told["rows_left_out"]:
        lines.append(f"{told['rows_left_out']} rows of tcp.csv left out: outside the loads' time, or incomplete")
    if told["asked_s"]:
        lines.append("asked for a measurement after " + ", ".join(f"{t / 3600:.2f}" for t in told["asked_s"]) + " h")
    titles = {"all": "every row before it was used", "after_first": "the same after the first measurement used"}
    for part, scores in told["before_assimilating"].items():
        lines.append(f"{titles[part]} [um, and share of the error computed]:")
        for name, by_output in scores.items():
            cells = [_cell(output, figures) for output, figures in by_output.items()]
            lines.append(f"  {name.replace('_', ' '):<10}" + "   ".join(cells))
    if told["coverage_95"] is not None:
        lines.append(f"{told['coverage_95']:.0%} of the rows lie inside their predicted 95 % interval")
    for gated in told["rejected_tcp"]:
        lines.append(
            f"left out: {gated['axis']} after {gated['time_s'] / 3600:.2f} h, {1e6 * gated['innovation_m']:+.1f} um "
            f"from its prediction ({1e6 * gated['sigma_m']:.1f} um expected)"
        )
    sensors = {n: k for n, k in told["rejected"].items() if n not in ("dx", "dy", "dz")}
    for name, count in sensors.items():
        lines.append(f"left out: {count} readings of sensor {name} that nothing explains")
    return lines


def _cell(output: str, figures: dict[str, Any]) -> str:
    share = "   -  " if figures["share"] is None else f"{figures['share']:6.1%}"
    return f"{output} rms {1e6 * figures['rms']:5.2f} max {1e6 * figures['max_abs']:5.1f} {share}"
