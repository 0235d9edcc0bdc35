"""Both servers in one event loop, until a signal ends them."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import socket
import ssl
import sys
from collections.abc import Callable
from dataclasses import dataclass
from ipaddress import ip_address
from pathlib import Path

import uvicorn
from starlette.applications import Starlette

from twin.errors import TwinError
from twin.serve.opcua import OpcUaServer

LOOK = 1.0  # s between two looks of the OPC UA server at what is new
BUSY = 64  # connections at a time: a page needs six


def is_loopback(host: str) -> bool:
    """Whether nobody from outside can reach this address."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def listening(host: str, port: int) -> socket.socket:
    """A socket there. Raises TwinError where that cannot be."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        made = socket.socket(family, kind, protocol)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.bind(address)
        made.listen(BUSY)  # who comes before the first answer waits
    except (OSError, UnicodeError, OverflowError) as e:
        what = getattr(e, "strerror", None) or str(e)
        raise TwinError(
            f"cannot listen: {what}", f"{host}:{port}", "name another --port, or an address of this computer"
        ) from e
    return made


@dataclass(frozen=True)
class Tls:
    """What the page is encrypted with, both PEM; the key has no password."""

    certificate: Path
    key: Path

    def check(self) -> None:
        """Raises TwinError where the files are missing, no such files, or do not belong together."""
        for path in (self.certificate, self.key):
            if not path.is_file():
                raise TwinError("no such file", str(path), "give a certificate and its key, in PEM")
        try:
            # a password is never asked for: a server that starts by itself would wait for ever
            ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(self.certificate, self.key, password=lambda: "")
        except (OSError, ValueError) as e:  # ssl.SSLError is an OSError
            what = f"no certificate with its key: {getattr(e, 'reason', None) or e}"
            raise TwinError(what, f"{self.certificate}, {self.key}", "give both in PEM, the key unencrypted") from e


def run_until_signal(
    app: Starlette,
    place: socket.socket,
    opcua: OpcUaServer | None,
    tls: Tls | None = None,
    ready: Callable[[], None] = lambda: None,
) -> None:
    """Serve until SIGTERM or SIGINT; `ready` is called when both answer. Raises TwinError where OPC UA cannot start."""
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: None)  # uvicorn raises it again when it has ended: that is no failure
    asyncio.run(_both(app, place, opcua, tls, ready))


async def _both(
    app: Starlette, place: socket.socket, opcua: OpcUaServer | None, tls: Tls | None, ready: Callable[[], None]
) -> None:
    config = uvicorn.Config(
        app, log_level="error", access_log=False, server_header=False, proxy_headers=False, ws="none", lifespan="off",
        limit_concurrency=BUSY, timeout_graceful_shutdown=2,
        ssl_certfile=tls.certificate if tls else None, ssl_keyfile=tls.key if tls else None,
    )  # fmt: skip
    if opcua is not None:
        await opcua.start()
    updates = asyncio.create_task(_updates(opcua)) if opcua is not None else None
    ready()
    try:
        await uvicorn.Server(config).serve(sockets=[place])
    finally:
        if updates is not None and opcua is not None:
            updates.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await updates
            await opcua.stop()


async def _updates(opcua: OpcUaServer) -> None:
    told = ""
    while True:
        await asyncio.sleep(LOOK)
        try:
            await opcua.update()
        except Exception as e:  # a record of another version, say: the page goes on, and clients see bad values
            if str(e) != told:
                told = str(e)
                print(f"OPC UA: no values: {type(e).__name__} {e}", file=sys.stderr, flush=True)
            await opcua.fail()
