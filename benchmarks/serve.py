"""`twin serve`: first paint, frames per second while turning, the frozen page, OPC UA reads, the drawn shape.

Pages are drawn by Chromium without a head and WebGL by software (SwiftShader): a computer with a graphics processor
draws more frames. Needs the extras `serve` and `compare`, and Chromium.
"""

from __future__ import annotations

import asyncio
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from benchmarks.five_axis import FOLDER
from benchmarks.live import artefact, cpu
from twin.build.displacement_field import DisplacementField
from twin.build.full_model import assemble
from twin.build.structure import Structure
from twin.cli.main import run
from twin.machine.load import load_machine
from twin.page.shape import shape_of
from twin.rom.artefact import read_artefact

RUN = FOLDER / "runs" / "experiment_a"
PAINTS, FRAMES, READS = 5, 90, 3000
FLAGS = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing", "--no-sandbox")
FIELDS = 3  # random ones that the drawn shape is held against


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        result = folder / "experiment_a"
        run(["run", str(artefact()), str(RUN), "-o", str(result)])
        run(["report", str(artefact()), str(result)])
        print(f"   frozen page of experiment A: {(result / 'index.html').stat().st_size / 1e6:.1f} MB")
        (folder / "password").write_text("password of the benchmark")
        command = [
            sys.executable, "-m", "twin.cli.main", "serve", str(artefact()), str(result), "--port", "0",
            "--opcua", "opc.tcp://127.0.0.1:48400/twin", "--password-file", str(folder / "password"),
            "--pki", str(folder / "pki"),
        ]  # fmt: skip
        began = time.perf_counter()
        server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert server.stdout is not None
        url = server.stdout.readline().partition("page: ")[2].strip()
        load = f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
        print(f"   serving after {time.perf_counter() - began:.1f} s; {load}", flush=True)
        try:
            pages(url, (result / "index.html").as_uri())
            asyncio.run(reads(folder, server.pid))
        finally:
            server.send_signal(signal.SIGTERM)
            server.wait()
    drawn_shape()


def pages(*urls: str) -> None:
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        sync_playwright = None
    path = shutil.which("chromium") or shutil.which("google-chrome")
    if sync_playwright is None or path is None:
        print("   no page is drawn: that needs playwright and Chromium")
        return
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=list(FLAGS))
        for url, (width, height) in ((u, s) for u in urls for s in ((1400, 900), (390, 844))):
            drawn, paint = [], []
            for _ in range(PAINTS):
                tab = browser.new_page(viewport={"width": width, "height": height})
                tab.goto(url)
                tab.wait_for_selector("body[data-ready=yes]", timeout=60_000)
                tab.wait_for_timeout(2000)
                drawn.append(tab.evaluate("performance.getEntriesByName('drawn')[0].startTime") / 1000)
                paint.append(tab.evaluate("performance.getEntriesByType('paint')[0].startTime") / 1000)
                fps = tab.evaluate(f"page.surface.stage.spin({FRAMES})")
                share = tab.evaluate("page.surface.stage.share")
                tab.close()
            kind = "frozen" if url.startswith("file:") else "served"
            print(
                f"   {kind}, {width} px: first paint {np.median(paint):.2f} s, all drawn {np.median(drawn):.2f} s "
                f"(longest of {PAINTS}: {max(drawn):.2f} s); turning {fps:.0f} frames per second, at {share:.2f} of "
                "the pixels in each direction",
                flush=True,
            )
        browser.close()


async def reads(folder: Path, server: int) -> None:
    """One after the other, and many nodes at a time."""
    from asyncua import Client
    from asyncua.crypto.cert_gen import setup_self_signed_certificate
    from cryptography.x509.oid import ExtendedKeyUsageOID

    key, certificate, uri = folder / "client.pem", folder / "client.der", "urn:twin:benchmark"
    await setup_self_signed_certificate(
        key, certificate, uri, "127.0.0.1", [ExtendedKeyUsageOID.CLIENT_AUTH], {"commonName": "benchmark"}
    )
    client: Any = Client("opc.tcp://127.0.0.1:48400/twin", timeout=20)
    client.application_uri = uri
    await client.set_security_string(f"Basic256Sha256,SignAndEncrypt,{certificate},{key}")
    client.set_user("twin")
    client.set_password("password of the benchmark")
    async with client:
        space = await client.get_namespace_index("urn:twin:machine")
        sensors = read_artefact(artefact()).model.sensors
        nodes = [client.get_node(f"ns={space};s=temperatures.{name}") for name in sensors]
        began, of_server, own = time.perf_counter(), cpu(server), time.process_time()
        for k in range(READS):
            await nodes[k % len(nodes)].read_value()
        alone = READS / (time.perf_counter() - began)
        of_server, own = 1e3 * (cpu(server) - of_server) / READS, 1e3 * (time.process_time() - own) / READS
        began = time.perf_counter()
        for _ in range(READS // len(nodes)):
            await client.read_values(nodes)
        together = (READS // len(nodes)) * len(nodes) / (time.perf_counter() - began)
    print(
        f"   OPC UA, encrypted: {alone:.0f} reads/s one request after the other ({of_server:.2f} ms of a core each at "
        f"the server, {own:.2f} ms at the client), {together:.0f} values/s in requests of {len(nodes)} nodes; load "
        f"{os.getloadavg()[0]:.1f} on {os.cpu_count()} cores",
        flush=True,
    )


def drawn_shape() -> None:
    """The drawn displacements against those of every node of the full model."""
    machine, read = load_machine(FOLDER), read_artefact(artefact())
    full, shape = assemble(machine), shape_of(read)
    assert isinstance(full.structure, Structure)
    assert shape is not None
    names = [b.name for b in full.thermal.bodies]
    shares: dict[str, list[float]] = {name: [] for name in names}
    for seed in range(FIELDS):
        rng = np.random.default_rng(seed)
        fields = [
            spsolve(
                sp.csc_array(b.A0 + sum(10.0 * a for a in b.A) + 1e-5 * b.E),
                b.B @ (100.0 * rng.random(b.B.shape[1])) + b.P @ (20.0 * rng.random(b.P.shape[1])),
            )
            for b in full.thermal.bodies
        ]
        position = np.zeros(len(full.structure.axes))
        exact = DisplacementField(machine, full.bodies, full.structure)(position, fields)
        heat = np.concatenate([b.H @ T for b, T in zip(full.structure.bodies, fields, strict=True)])
        ports = full.structure.port_displacements(position, heat)
        for field, body in zip(read.fields, shape.bodies, strict=True):
            b = names.index(field.body)
            surface = full.thermal.bodies[b].F
            wanted = surface[:, : len(exact[b])] @ exact[b]
            error = body(surface @ fields[b], ports) - wanted
            shares[field.body].append(float(np.sqrt((error**2).mean() / (wanted**2).mean())))
    told = ", ".join(f"{name} {100 * max(s):.0f} %" for name, s in shares.items())
    print(f"   drawn shape, rms of its error over rms of the displacement, all sources and ports heated: {told}")
