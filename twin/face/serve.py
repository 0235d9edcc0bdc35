"""A page, and an OPC UA server, of a finished run or of a running machine."""

from __future__ import annotations

import os
import secrets
import socket
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from twin.errors import TwinError

if TYPE_CHECKING:
    from twin.serve.finished_run import FinishedRun
    from twin.serve.live_state import LiveState
    from twin.serve.opcua import Access
    from twin.serve.start import Tls

SHORTEST = 16  # characters of a token that a person chooses


@dataclass(frozen=True)
class ServeOptions:
    """Where to listen, and who may read."""

    host: str = "127.0.0.1"  # anything else needs a token
    port: int = 8765
    token: str | None = None  # None: none on this computer, a random one where others reach it
    certificate: str | Path | None = None  # PEM, with key: the page goes by https
    key: str | Path | None = None
    name: tuple[str, ...] = ()  # of this computer, beside its own, that browsers may ask for
    opcua: str | None = None  # opc.tcp://HOST:PORT/PATH
    user: str = "twin"  # of OPC UA
    password_file: str | Path | None = None  # None: a random password
    pki: str | Path | None = None  # folder of keys and certificates; None: ~/.config/twin/opcua


def serve(
    artefact: str | Path,
    output: str | Path | None = None,
    live: str | Path | None = None,
    options: ServeOptions | None = None,
    say: Callable[[str], None] = print,
) -> None:
    """Serve a finished run (`output`, of `twin run -o`) or a running machine (`live`, the --state of `twin live`).

    Until SIGTERM or SIGINT. `say` gets the address and, where they were made here, token and password. Raises TwinError
    for what is none of these, a short token, and ports that are taken.
    """
    options = options or ServeOptions()
    if (output is None) == (live is None):
        raise TwinError(
            "one of OUTPUT and --live is needed", "twin serve", "name a result, or --live and a state folder"
        )
    try:
        from twin.serve.app import application
        from twin.serve.start import is_loopback, listening, run_until_signal
    except ModuleNotFoundError as e:
        if (e.name or "").partition(".")[0] == "twin":
            raise
        raise TwinError(
            f"the package '{e.name}' is missing", "twin serve", "python -m pip install 'twin[serve]'"
        ) from e
    from twin.serve.opcua import OpcUaServer

    token = _token(options, is_loopback(options.host))
    tls = _tls(options)
    shown = _shown(artefact, output, live)
    place = listening(options.host, options.port)
    port = place.getsockname()[1]
    server = None
    if options.opcua is not None:
        access, told = _access(options)
        server = OpcUaServer(shown.artefact, shown, options.opcua, access)
    app = application(shown, token, (socket.gethostname(), *options.name))

    def ready() -> None:
        host = f"[{options.host}]" if ":" in options.host else options.host
        say(f"page: {'http' if tls is None else 'https'}://{host}:{port}/" + (f"?token={token}" if token else ""))
        if server is not None:
            say(f"OPC UA: {options.opcua}, user {told}")

    run_until_signal(app, place, server, tls, ready)


def _shown(artefact: str | Path, output: str | Path | None, live: str | Path | None) -> FinishedRun | LiveState:
    from twin.rom.artefact import read_artefact

    read = read_artefact(Path(artefact))
    if live is not None:
        from twin.serve.live_state import LiveState

        return LiveState(read, Path(live))
    from twin.serve.finished_run import FinishedRun

    assert output is not None
    return FinishedRun(read, Path(output))


def _tls(options: ServeOptions) -> Tls | None:
    from twin.serve.start import Tls

    if (options.certificate is None) != (options.key is None):
        raise TwinError("a certificate and its key go together", "--certificate, --key", "give both, or neither")
    if options.certificate is None or options.key is None:
        return None
    made = Tls(Path(options.certificate), Path(options.key))
    made.check()
    return made


def _token(options: ServeOptions, loopback: bool) -> str | None:
    if options.token is not None and len(options.token) < SHORTEST:
        what = f"a token of {len(options.token)} characters can be guessed"
        raise TwinError(what, "--token", f"write at least {SHORTEST}, or leave it out: a random one is printed")
    if options.token is not None or loopback:
        return options.token
    return secrets.token_urlsafe(32)


def _access(options: ServeOptions) -> tuple[Access, str]:
    """And what is said of it."""
    from twin.serve.opcua import Access

    base = Path(os.environ.get("XDG_CONFIG_HOME", Path.home() / ".config"))
    folder = base / "twin" / "opcua" if options.pki is None else Path(options.pki)
    if options.password_file is None:
        password = secrets.token_urlsafe(18)
        return Access(options.user, password, folder), f"{options.user}, password {password}"
    try:
        password = Path(options.password_file).read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as e:
        raise TwinError(f"cannot read: {e}", str(options.password_file), "check the path") from e
    if not password:
        raise TwinError("is empty", str(options.password_file), "write a password into it")
    return Access(options.user, password, folder), f"{options.user}, password as in {options.password_file}"
