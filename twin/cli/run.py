"""twin run: replay a run folder on an artefact."""

from __future__ import annotations

import click


@click.command(epilog="Example: twin run out/five_axis.h5 models/five_axis/runs/experiment_a -o out/run --dt '60 s'")
@click.argument("artefact", type=click.Path())
@click.argument("run", type=click.Path())
@click.option("-o", "--output", required=True, type=click.Path(), help="folder for the results")
@click.option("--dt", default="60 s", show_default=True, help="time step")
@click.option("--substeps", default=4, show_default=True, type=click.IntRange(1), help="implicit Euler steps per step")
@click.option("--initial", help="temperature at the start, e.g. '20 degC', or a result.h5 to go on from  "
              "[default: the run's own, else of the air around it]")  # fmt: skip
@click.option("--checkpoint", default=1440, show_default=True, type=click.IntRange(1), help="steps between checkpoints")
@click.option("--resume", is_flag=True, help="go on after an interruption, with exactly the same numbers")
def command(
    artefact: str, run: str, output: str, dt: str, substeps: int, initial: str | None, checkpoint: int, resume: bool
) -> None:
    """Step the model of ARTEFACT through the loads of RUN.

    Writes result.h5 (everything), temperatures.csv and tcp.csv (as in a run folder) and summary.json to OUTPUT.
    """
    from twin.run.replay import replay  # isort: skip  first: it prepares JAX before NumPy is loaded

    from pathlib import Path

    import numpy as np

    from twin import __version__
    from twin.atomic import check_folder
    from twin.cli.quantity import option, positive
    from twin.errors import TwinError
    from twin.logs.read import read_run
    from twin.progress import bar
    from twin.rom.artefact import read_artefact
    from twin.run.checkpoint import CheckpointFolder
    from twin.run.results import read_final_state, refuse_run_folder, write_results

    loaded = read_artefact(Path(artefact))
    step = positive("--dt", dt, "s")
    start: float | np.ndarray | None = None
    if initial is not None:
        if initial.endswith(".h5"):
            start = read_final_state(Path(initial), loaded.digest)
        else:
            start = option("--initial", initial, "degC")
            if not -60.0 <= start <= 200.0:  # 20 K and 293 degC are slips
                raise TwinError(f"{initial} is no temperature", "--initial", "write --initial '20 degC', for example")
    folder = Path(output)
    check_folder(folder)
    refuse_run_folder(folder)
    checkpoints = CheckpointFolder(folder / "checkpoints", checkpoint, resume)
    result = replay(loaded, read_run(Path(run)), step, substeps, start, checkpoints, bar)
    facts = {
        "machine": loaded.model.name,
        "artefact": artefact,
        "run": run,
        "initial": initial if initial is not None else "from the run",
        "twin": __version__,
    }
    told = write_results(folder, result, facts)
    checkpoints.clear()  # the results hold all of it
    worst = told["tcp"]["worst"]
    place = ", ".join(f"{axis} {1e3 * value:.0f} mm" for axis, value in worst["pose_m"].items())
    largest = (
        f"largest TCP error d{worst['component']} {1e6 * worst['value_m']:.1f} um after {worst['time_s'] / 3600:.2f} h "
        f"at {place or 'the only pose'}"
        if loaded.model.moves
        else "no temperature moves the tool"
    )
    click.echo(
        f"{output}: {told['steps']} steps of {step:g} s; {largest}; "
        f"heat balance closes to {told['heat']['max_balance_error']:.1e} of the throughput"
    )
    raised = {name: flag for name, flag in told["flags"].items() if flag["steps"]}
    if raised:
        click.echo(f"outside what was certified in {told['flagged_steps']} of {told['steps']} steps:")
        for name, flag in raised.items():
            click.echo(f"  {name}: {flag['steps']} steps, first at {flag['first_s']:g} s")
