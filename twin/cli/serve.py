"""twin serve: the page of a result or of a running machine, and an OPC UA server."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from twin.cli.bundle import bundled

if TYPE_CHECKING:
    from twin.face.serve import ServeOptions


def _options() -> type[Any]:
    from twin.face.serve import ServeOptions

    return ServeOptions


@click.command(epilog="Example: twin serve out/five_axis.h5 out/experiment_a")
@click.argument("artefact", type=click.Path())
@click.argument("output", type=click.Path(), required=False)
@click.option("--live", type=click.Path(), help="the --state of `twin live`, instead of OUTPUT")
@click.option("--host", default="127.0.0.1", show_default=True, help="address to listen at; where others "
              "reach it, a token is needed")  # fmt: skip
@click.option("--port", type=click.IntRange(0, 65535), default=8765, show_default=True, help="0: any that is free")
@click.option("--token", envvar="TWIN_TOKEN", help="who gives it may read, 16 characters at least  [default: a random "
              "one where others reach the page]")  # fmt: skip
@click.option("--certificate", type=click.Path(), help="PEM; with --key, the page goes by https")
@click.option("--key", type=click.Path(), help="key of the certificate, PEM without a password")
@click.option("--name", multiple=True, help="a name of this computer that browsers may ask for; may be given again")
@click.option("--opcua", help="also an OPC UA server there, e.g. opc.tcp://127.0.0.1:4840/twin")
@click.option("--user", default="twin", show_default=True, help="user name of OPC UA")
@click.option("--password-file", type=click.Path(), help="its password  [default: a random one, printed]")
@click.option("--pki", type=click.Path(), help="folder of server.der, server.pem (made where missing) and trusted/  "
              "[default: ~/.config/twin/opcua]")  # fmt: skip
@bundled(_options)
def command(artefact: str, output: str | None, live: str | None, options: ServeOptions) -> None:
    """Show what `twin run ARTEFACT RUN -o OUTPUT` left in OUTPUT, or with --live a running machine, to a browser.

    The page is only read. It answers to this computer alone unless --host says otherwise; then a token is needed.
    """
    from twin.face.serve import serve

    serve(artefact, output, live, options, click.echo)
