"""twin calibrate: fit an artefact's parameters to measured runs."""

from __future__ import annotations

import click


@click.command(
    epilog="Example: twin calibrate out/five_axis.h5 out/truth -o out/calibrated.h5 --only 'sources.*' --only 'films.*'"
)
@click.argument("artefact", type=click.Path())
@click.argument("runs", type=click.Path(), nargs=-1, required=True)
@click.option("-o", "--output", required=True, type=click.Path(), help="artefact to write")
@click.option(
    "--only", multiple=True, help="parameters to fit: a path, or a pattern such as 'sources.*'  [default: all]"
)
@click.option("--hold", multiple=True, help="parameters to leave as they are; both repeatable")
@click.option("--iterations", default=30, show_default=True, type=click.IntRange(1), help="stop after so many")
@click.option("--budget", default="10 min", show_default=True, help="stop after this time")
@click.option("--noise", default="0.1 K", show_default=True, help="standard deviation of one temperature sample")
@click.option("--tcp-noise", default="1 um", show_default=True, help="of a TCP deviation, where tcp.csv has no sigma")
@click.option(
    "--initial", default="0.3 K", show_default=True, help="how far parts may be from it in runs without a known start"
)
@click.option("--form", default=0.03, show_default=True, type=click.FloatRange(0, 1),
              help="share by which the model's response to each source may be wrong")  # fmt: skip
@click.option("--exclude", multiple=True, help="sensor to leave out; repeatable")
@click.option("--window", help="fit on sliding windows of this length, as on a running machine; RUNS is then one run")
@click.option("--every", default="1 h", show_default=True, help="with --window: time between fits")
@click.option("--machine", type=click.Path(), help="also write the edited description here")
@click.option("--json", "as_json", is_flag=True, help="print the report as JSON")
def command(
    artefact: str, runs: tuple[str, ...], output: str, only: tuple[str, ...], hold: tuple[str, ...], iterations: int,
    budget: str, noise: str, tcp_noise: str, initial: str, form: float, exclude: tuple[str, ...], window: str | None,
    every: str, machine: str | None, as_json: bool,
) -> int:  # fmt: skip
    """Fit the parameters of ARTEFACT to the temperatures and TCP deviations measured in RUNS.

    Bounded least squares with priors; stops at the minimum, after --iterations or after --budget, and Ctrl-C during the
    iterations keeps the best values so far. Writes the artefact with the fitted values and OUTPUT.json with values,
    intervals, pulls, what the data cannot separate and which experiment would. Check it on a run it was not fitted to:
    `twin score`.
    """
    import json
    import math
    from pathlib import Path
    from typing import Any

    import twin.run.jax_setup
    from twin.atomic import atomic_path, check_file
    from twin.calibrate.fit.calibration import calibrate, chosen, windows
    from twin.calibrate.fit.fit import Iteration, Stop
    from twin.calibrate.fit.options import Options
    from twin.calibrate.fit.product import told, write_calibrated, write_report
    from twin.cli.calibrate_text import lines
    from twin.cli.quantity import positive
    from twin.errors import LogError, TwinError
    from twin.logs.read import read_run
    from twin.progress import bar, silent
    from twin.rom.artefact import read_artefact
    from twin.run.results import refuse_run_folder

    target = Path(output)
    if target.suffix != ".h5":
        raise TwinError("an artefact's name ends with .h5", f"-o {output}", "for example -o out/calibrated.h5")
    if machine is not None and Path(machine).suffix != ".toml":
        raise TwinError("a description's name ends with .toml", f"--machine {machine}", "name another file")
    if machine is not None:
        import twin.machine.edit  # noqa: F401  needs the workstation's packages: say so now, not after the fit
    for written in (target, target.with_suffix(".json"), *([Path(machine)] if machine else [])):
        check_file(written)
        refuse_run_folder(written.parent)
        if written.exists() and Path(artefact).exists() and written.samefile(artefact):
            raise TwinError("would replace the artefact it starts from", str(written), "name another file with -o")
    if len({Path(run).resolve() for run in runs}) < len(runs):
        raise TwinError("a run is given twice", "RUNS", "give each once: a run is no more evidence when read again")
    if not math.isfinite(form):
        raise TwinError(f"{form} is out of range", "--form", "give a share, for example --form 0.03")
    loaded = read_artefact(Path(artefact))
    options = Options(
        temperature_sigma=positive("--noise", noise, "K"),
        tcp_sigma=positive("--tcp-noise", tcp_noise, "m"),
        initial_sigma=positive("--initial", initial, "K", zero=True),
        form_tolerance=form,
        exclude=exclude,
    )
    unknown = sorted(set(exclude) - set(loaded.model.sensors))
    if unknown:
        raise TwinError(f"no sensor '{unknown[0]}'", "--exclude", f"sensors are: {', '.join(loaded.model.sensors)}")
    read = [read_run(Path(run)) for run in runs]
    if window is not None:
        if len(read) != 1:
            raise TwinError("sliding windows go through one run", "--window", "give one RUN")
        length, between = positive("--window", window, "s"), positive("--every", every, "s")
        span = float(read[0].loads.time[-1] - read[0].loads.time[0])
        if between > span:
            raise TwinError(f"the run covers {span / 3600:.2f} h only", f"--every {every}", "give a shorter time")
        read = windows(read[0], length, between)
    parameters = chosen(loaded, only, hold, any(run.tcp is not None for run in read))
    stop = Stop(iterations, positive("--budget", budget, "s"))

    def report(iteration: Iteration) -> None:
        if not as_json:
            click.echo(
                f"  iteration {iteration.number}: cost {iteration.cost:.6g}, {iteration.seconds:.0f} s", err=True
            )

    progress = silent if as_json else bar
    steps = [read] if window is None else [[run] for run in read]
    facts: dict[str, Any] = {}
    for k, these in enumerate(steps):
        try:
            result = calibrate(loaded, these, parameters, options, stop, report, progress)
        except LogError as e:  # a window may hold nothing to compare; a run may not
            if window is None:
                raise
            click.echo(f"{these[0].loads.time[-1] / 3600:.1f} h: {e.problems[0].what}", err=as_json)
            continue
        facts = told(result, these, experiments=k == len(steps) - 1)
        if window is not None and not as_json:
            moved = sorted(facts["parameters"], key=lambda row: -abs(row["pull"]))[:3]
            what = ", ".join(f"{row['path']} {row['value']:.3g} +- {row['sigma']:.2g}" for row in moved)
            click.echo(f"{these[0].loads.time[-1] / 3600:.1f} h: {result.fit.stopped}, {what}")
        if result.fit.stopped == "interrupted":
            break
    if not facts:
        raise TwinError("nothing was measured in any window", runs[0], "give a run with temperatures.csv or tcp.csv")
    shown = " ".join(["twin calibrate", artefact, *runs, "-o", output])
    text = write_calibrated(loaded, target, facts, parameters, shown)
    write_report(target.with_suffix(".json"), facts)
    if machine is not None:
        with atomic_path(Path(machine)) as temporary:
            temporary.write_text(text, encoding="utf-8")
    click.echo(json.dumps(facts, indent=1) if as_json else "\n".join(lines(facts, output)))
    return 130 if facts["stopped"] == "interrupted" else 0
