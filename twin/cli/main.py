"""The command `twin`: finds the command asked for, imports only that, and turns errors into one block and a status.

Exit status: 0 done, 1 the check that the command makes has failed, 2 bad input (also errors that `check` finds), 130
interrupted.
"""

from __future__ import annotations

import errno
import importlib
import keyword
import os
import signal
import sys

import click

from twin import __version__
from twin.errors import TwinError
from twin.progress import interrupt
from twin.threads import one_thread_each

# name -> what `twin --help` says about it; the command object is twin.cli.NAME.command (twin.cli.NAME_ of a keyword)
COMMANDS = {
    "new": "Begin a machine from a template, or from nothing but a log.",
    "import": "Reduce matrices that another program assembled.",
    "check": "Find mistakes in a machine description or a run folder.",
    "show": "Show a machine as it is described, in a browser, before anything is built.",
    "unpack": "Turn a file of load blocks into a run folder.",
    "losses": "Show the heat of every source, every film coefficient, and where they come from.",
    "simulate": "Step the full model through a run and write a run folder.",
    "build": "Reduce a machine to an artefact with a certificate.",
    "verify": "Test an artefact against the full model on held-out scenarios.",
    "run": "Run an artefact on a run folder: temperatures, TCP error.",
    "live": "Run an artefact beside the machine: load blocks in, axis offsets out.",
    "score": "Score an artefact on measured runs, beside naive baselines.",
    "calibrate": "Fit an artefact's parameters to measured runs.",
    "update": "Correct an artefact online by sparse TCP measurements.",
    "diagnose": "Find why an artefact differs from measured runs, name the cause, extend the model.",
    "rtest": "Find single axis errors (ISO 230-1) from R-tests.",
    "info": "Show what is in an artefact.",
    "hide": "Inject a fault into a copy of a machine or a log, as a truth for experiments.",
    "report": "Draw the pictures of a result, and its page.",
    "serve": "Show a result or a running machine in a browser, and by OPC UA.",
    "poses": "Find the pose grid that suffices for a run, and the shares of the volumetric error.",
    "correction": "Compress the TCP error of a result to polynomials for the control.",
    "export": "Write an artefact for other tools: C, FMU, state space, control tables.",
    "warmup": "Tell when a result has warmed up, and how it drifts at the end.",
    "demo": "Build, verify and run the shipped five-axis machine.",
}


class LazyGroup(click.Group):
    """A group whose commands are imported when called: `twin run` must not wait for the assembly of matrices."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        one_thread_each()
        module = f"twin.cli.{name}_" if keyword.iskeyword(name) else f"twin.cli.{name}"
        command: click.Command = importlib.import_module(module).command
        if command.epilog and not command.epilog.startswith("\b"):
            command.epilog = f"\b\n{command.epilog}"  # an example that is wrapped cannot be pasted
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            from twin.nearest import did_you_mean

            ctx.fail(f"no command '{args[0]}': {did_you_mean(args[0], COMMANDS, 'commands')}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Example: twin check models/five_axis",
)
@click.version_option(__version__, prog_name="twin")
@click.option("--traceback", is_flag=True, help="Show where in the program an error arose.")
def cli(traceback: bool) -> None:
    """Compile a machine-tool description into a reduced thermo-elastic model and run it beside the machine.

    Exit status: 0 done, 1 the check that a command makes has failed, 2 bad input (also errors that `twin check`
    finds), 130 interrupted.
    """


def main() -> None:
    """Run the command line and exit."""
    signal.signal(signal.SIGINT, interrupt)
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run the command line with `arguments`; returns the exit status. Mistakes of the program itself are raised."""
    try:
        status = cli.main(args=arguments, prog_name="twin", standalone_mode=False)
        return status if isinstance(status, int) else 0
    except click.exceptions.Exit as e:
        return e.exit_code
    except click.ClickException as e:
        e.show()
        return 2
    except BrokenPipeError:
        # the reader of a pipe has gone (`twin info A.h5 | head`): nothing to complain about, nor to flush at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except BaseException as e:
        message = _message(e)
        if message is None:
            raise
        if "--traceback" in arguments:
            import traceback  # slow to import, and seldom asked for

            traceback.print_exc()
        click.echo(message, err=True)
        if isinstance(e, KeyboardInterrupt | click.Abort):
            return 130
        return e.status if isinstance(e, TwinError) else 2


def _message(e: BaseException) -> str | None:
    """What to tell about an error that the user can do something about; None for mistakes of the program."""
    if isinstance(e, KeyboardInterrupt | click.Abort):
        return "interrupted, nothing half-written"
    if isinstance(e, TwinError):
        return f"error: {e}"
    if isinstance(e, OSError):
        return f"error: {e.filename or 'file system'}: {e.strerror or e}\n    remedy: {_remedy(e)}"
    if isinstance(e, ModuleNotFoundError) and (e.name or "").partition(".")[0] != "twin":
        return f"error: the package '{e.name}' is missing\n    remedy: python -m pip install 'twin[build]'"
    if isinstance(e, MemoryError):
        return "error: out of memory\n    remedy: use a coarser mesh, fewer states, or a machine with more memory"
    return None


def _remedy(e: OSError) -> str:
    return {
        errno.ENOSPC: "free disk space or choose another folder; nothing half-written was left",
        errno.EDQUOT: "your disk quota is used up: free space or choose another folder",
        errno.EACCES: "check the permissions of the file and its folder",
        errno.EROFS: "the file system is read-only: choose another folder",
        errno.ENOENT: "check the path",
    }.get(e.errno or 0, "check the file and the disk; --traceback shows where it happened")


if __name__ == "__main__":
    main()
