"""`twin serve` as a process of its own, and requests to it."""

from __future__ import annotations

import http.client
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from twin.face.live import LiveOptions, wired

RUN = Path(__file__).parents[1] / "machines" / "slide" / "runs" / "short"


class Server:
    """Started with `arguments`; its first lines are what it says."""

    def __init__(self, *arguments: str):
        command = [sys.executable, "-m", "twin.cli.main", "serve", *arguments, "--port", "0"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        assert self.process.stdout is not None
        self.first = self.process.stdout.readline().strip()
        self.url = self.first.partition("page: ")[2]

    def ask(self, path: str, method: str = "GET", **headers: str) -> http.client.HTTPResponse:
        place = urlsplit(self.url)
        connection = http.client.HTTPConnection(place.hostname or "", place.port, timeout=30)
        connection.putrequest(method, path, skip_host=True)
        for name, value in {"Host": place.netloc, **headers}.items():
            connection.putheader(name.replace("_", "-"), value)
        connection.endheaders()
        answer = connection.getresponse()
        answer.body = answer.read()  # type: ignore[attr-defined]
        return answer

    def stop(self) -> int:
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(20)


@pytest.fixture
def server() -> Iterator[Callable[..., Server]]:
    started: list[Server] = []

    def start(*arguments: str) -> Server:
        started.append(Server(*arguments))
        return started[-1]

    yield start
    for one in started:
        if one.process.poll() is None:
            one.stop()


@pytest.fixture(scope="session")
def state(slide_artefact: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that `twin live` leaves after the short run; do not write to it."""
    folder = tmp_path_factory.mktemp("live")
    options = LiveOptions(engine="jax", speed=0.0)
    runtime = wired(slide_artefact, f"replay:{RUN}", [f"file:{folder / 'out.json'}"], folder / "state", options)
    runtime.begin(True)
    runtime.run(lambda: False)
    return folder / "state"
