"""twin unpack: a file of load blocks as a run folder, with what was lost on the way told."""

from __future__ import annotations

import click

from twin.cli.quantity import Quantity


@click.command(epilog="Example: twin unpack models/five_axis/blocks/shift.twb -o out/shift --mean '1 min'")
@click.argument("file", type=click.Path())
@click.option("-o", "--output", required=True, type=click.Path(), help="run folder to write")
@click.option(
    "--mean", type=Quantity("s"), help="compress to means over this time, e.g. '10 s': rms currents, mean |speed|"
)
@click.option("--machine", help="path of the machine description, as run.toml will name it: relative to the run folder")
def command(file: str, output: str, mean: float | None, machine: str | None) -> None:
    """Put the load blocks of FILE in order and write them to OUTPUT as the loads of a run.

    With --mean the last interval may be shorter; a closing row stands where the last record ceases to hold.
    Blocks that are damaged, lost, repeated or out of order are counted; a gap is a row without values, which runs flag.
    """
    from pathlib import Path

    from twin.logs.unpack import unpack
    from twin.logs.write import refuse_to_destroy, write_run

    refuse_to_destroy(Path(output))
    run, counts, gaps = unpack(Path(file), mean, machine)
    write_run(Path(output), run)
    hours = (run.loads.time[-1] - run.loads.time[0]) / 3600
    click.echo(f"{output}: {len(run.loads.time)} rows over {hours:.2f} h of {len(run.loads.columns)} columns; {counts}")
    if gaps:
        click.echo(f"warning: {gaps} gap{'s' * (gaps > 1)} in the loads: the last values are held there and flagged")
