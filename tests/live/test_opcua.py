"""OPC UA with a real server on 127.0.0.1: signals read, offsets written, a wrong password refused."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

asyncua = pytest.importorskip("asyncua")

from asyncua import ua  # noqa: E402
from asyncua.crypto.cert_gen import (  # noqa: E402
    dump_private_key_as_pem,
    generate_private_key,
    setup_self_signed_certificate,
)
from asyncua.crypto.permission_rules import User, UserRole  # noqa: E402
from cryptography import x509  # noqa: E402
from cryptography.hazmat.primitives import hashes  # noqa: E402
from cryptography.hazmat.primitives.serialization import Encoding  # noqa: E402
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID  # noqa: E402

from tests.live.scripted import FACTS, NAMES, Kept, runtime  # noqa: E402
from twin.errors import TwinError  # noqa: E402
from twin.live.channels import Channels, read_channels  # noqa: E402
from twin.live.opcua import OpcUaSink, OpcUaSource  # noqa: E402
from twin.live.sinks import Sent  # noqa: E402

pytestmark = pytest.mark.long

CHANNELS = """
[opcua]
interval = "20 ms"
user = "twin"
password_file = "secret"
certificate = "client.der"
key = "client.pem"
heartbeat = "ns=2;s=beat"

[channels.x_position]
node = "ns=2;s=x_position"
unit = "mm"

[channels.x_current]
node = "ns=2;s=x_current"
high = "50 A"

[channels.air]
node = "ns=2;s=air"

[outputs]
offsets = "ns=2;s=offset_{axis}"
count = "ns=2;s=count"
mode = "ns=2;s=mode"
"""
VALUES = {"x_position": 250.0, "x_current": 7.0, "air": 21.5, "beat": 0.0}


class Manager:
    def get_user(self, iserver, username=None, password=None, certificate=None):
        return User(role=UserRole.User) if (username, password) == ("twin", "right") else None


class Control:
    """A server in a thread of its own, with encryption and passwords."""

    def __init__(self, folder, days=365):
        self.folder, self.days, self.loop = folder, days, asyncio.new_event_loop()
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            self.url = f"opc.tcp://127.0.0.1:{s.getsockname()[1]}"
        self.thread = threading.Thread(target=self.loop.run_forever, daemon=True)
        self.thread.start()
        self.do(self._start())

    def do(self, coroutine):
        return asyncio.run_coroutine_threadsafe(coroutine, self.loop).result(30)

    async def _certificate(self, name, use):
        await setup_self_signed_certificate(
            self.folder / f"{name}.pem", self.folder / f"{name}.der", f"urn:twin:{name}", "127.0.0.1", [use],
            {"commonName": name},
        )  # fmt: skip

    async def _start(self):
        if self.days < 0:
            certificate(self.folder, "server", self.days)
        else:
            await self._certificate("server", ExtendedKeyUsageOID.SERVER_AUTH)
        await self._certificate("client", ExtendedKeyUsageOID.CLIENT_AUTH)
        self.server = asyncua.Server(user_manager=Manager())
        await self.server.init()
        self.server.set_endpoint(self.url)
        self.server.set_security_policy([ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt])
        self.server.set_identity_tokens([ua.UserNameIdentityToken])
        await self.server.load_certificate(str(self.folder / "server.der"))
        await self.server.load_private_key(str(self.folder / "server.pem"))
        await self.server.register_namespace("urn:machine")
        objects = self.server.nodes.objects
        self.nodes = {}
        for name, value in {**VALUES, "offset_x": [0.0, 0.0, 0.0], "mode": ""}.items():
            self.nodes[name] = await objects.add_variable(f"ns=2;s={name}", name, value)
        self.nodes["count"] = await objects.add_variable("ns=2;s=count", "count", 0, ua.VariantType.Int64)
        for node in self.nodes.values():
            await node.set_writable()
        await self.server.start()

    def set(self, name, value, status=None):
        value = ua.DataValue(ua.Variant(value, ua.VariantType.Double), status or ua.StatusCode(0))
        self.do(self.server.write_attribute_value(self.nodes[name].nodeid, value))

    def get(self, name):
        return self.do(self.nodes[name].read_value())

    def stop(self):
        self.do(self.server.stop())
        self.loop.call_soon_threadsafe(self.loop.stop)
        self.thread.join(10)


@pytest.fixture(scope="module")
def control(tmp_path_factory):
    made = Control(tmp_path_factory.mktemp("opcua"))
    yield made
    made.stop()


def channels_of(control, password="right") -> Channels:
    (control.folder / "channels.toml").write_text(CHANNELS)
    (control.folder / "secret").write_text(password + "\n")
    return read_channels(control.folder / "channels.toml", FACTS)


def polled(source, blocks, seconds=20.0):
    found, until = [], time.monotonic() + seconds
    while len(found) < blocks and time.monotonic() < until:
        found += source.poll(0.3)
    return found


def test_signals_are_read_in_si_and_bad_ones_are_missing(control):
    channels = channels_of(control)
    assert channels.limits["x_current"] == {"high": 50.0}
    source = OpcUaSource(control.url, channels, FACTS)
    try:
        first, second = polled(source, 2)[:2]
        assert first.names == NAMES
        assert list(first.values[:3]) == pytest.approx([0.25, 7.0, 21.5])
        assert first.records == second.records == 10
        assert second.time == pytest.approx(first.end)
        control.set("air", 21.0, ua.StatusCode(ua.StatusCodes.BadSensorFailure))
        later = polled(source, 4)[-1]
        assert later.values[-1] != later.values[-1]
        assert later.values[-2] == 7.0
    finally:
        control.set("air", 21.5)
        source.close()


def test_a_wrong_password_is_refused_and_nothing_arrives(control):
    source = OpcUaSource(control.url, channels_of(control, "wrong"), FACTS)
    try:
        assert polled(source, 1, 3.0) == []
        source._connection._tried = -1e9
        with pytest.raises(ConnectionError):
            source._connection.client()
    finally:
        source.close()


def certificate(folder, name, days):
    """A key and a certificate of its own making that ends so many days from now, or ended so many ago."""
    key, who = generate_private_key(), x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    end = datetime.now(UTC) + timedelta(days=days)
    builder = x509.CertificateBuilder(who, who, key.public_key(), x509.random_serial_number())
    builder = builder.not_valid_before(end - timedelta(days=400)).not_valid_after(end)
    names = x509.SubjectAlternativeName([x509.UniformResourceIdentifier(f"urn:twin:{name}")])
    made = builder.add_extension(names, False).sign(key, hashes.SHA256())
    (folder / f"{name}.pem").write_bytes(dump_private_key_as_pem(key))
    (folder / f"{name}.der").write_bytes(made.public_bytes(Encoding.DER))


def test_a_client_certificate_that_has_expired_is_refused_at_once(control):
    channels = channels_of(control)
    expired = control.folder / "expired"
    expired.mkdir()
    certificate(expired, "client", -1)
    own = channels.opcua | {"certificate": "expired/client.der", "key": "expired/client.pem"}
    with pytest.raises(TwinError, match=r"certificate: valid from .* which is not now"):
        OpcUaSource(control.url, replace(channels, opcua=own), FACTS)
    (expired / "client.der").write_bytes(b"none")
    with pytest.raises(TwinError, match="no certificate"):
        OpcUaSource(control.url, replace(channels, opcua=own), FACTS)


def test_another_server_than_the_pinned_one_is_refused(control):
    channels = channels_of(control)
    certificate(control.folder, "other", 365)
    for name, blocks in (("server", 1), ("other", 0)):
        source = OpcUaSource(
            control.url, replace(channels, opcua=channels.opcua | {"server_certificate": f"{name}.der"}), FACTS
        )
        try:
            assert len(polled(source, 1, 10.0 if blocks else 3.0)) == blocks
        finally:
            source.close()


def test_a_server_whose_certificate_has_expired_is_refused(tmp_path):
    control = Control(tmp_path, days=-1)
    source = OpcUaSource(control.url, channels_of(control), FACTS)
    try:
        assert polled(source, 1, 3.0) == []
        source._connection._tried = -1e9
        with pytest.raises(ConnectionError, match="BadCertificateTimeInvalid"):
            source._connection.client()
    finally:
        source.close()
        control.stop()


def test_offsets_are_written_and_read_back(control):
    sink = OpcUaSink(FACTS, control.url, channels_of(control))
    try:
        sink.write(Sent(3, 1e9, 1e9 + 5.0, "following", "", ((1e-6, 2e-6, 3e-6),)))
        assert control.get("offset_x") == [1e-6, 2e-6, 3e-6]
        assert (control.get("count"), control.get("mode")) == (3, "following")
        assert sink.last() == ((1e-6, 2e-6, 3e-6),)
    finally:
        sink.close()


def test_a_server_that_goes_away_is_a_gap_and_no_jump(tmp_path):
    control = Control(tmp_path)
    source = OpcUaSource(control.url, channels_of(control), FACTS)
    made = runtime(tmp_path / "state", source, sink := Kept())
    made.begin(True)
    until = time.monotonic() + 20.0
    while made.intake.records < 20 and time.monotonic() < until:
        made.once(0.3)
    before = made.intake.records
    assert before >= 20
    control.stop()
    for _ in range(3):
        made.once(0.3)
    assert made.intake.records - before <= 20
    made.close()
    assert all(s.values == ((0.0,) * 3,) for s in sink.sent)
