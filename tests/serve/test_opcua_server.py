"""The OPC UA server with asyncua's client: values with units and stamps, nothing written, nobody let in who may not."""

from __future__ import annotations

import asyncio
import datetime
import shutil
import socket
from pathlib import Path

import numpy as np
import pytest

asyncua = pytest.importorskip("asyncua")

from asyncua import Client, ua  # noqa: E402
from cryptography import x509  # noqa: E402
from cryptography.hazmat.primitives import hashes, serialization  # noqa: E402
from cryptography.hazmat.primitives.asymmetric import rsa  # noqa: E402
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID  # noqa: E402

from twin.pictures.result import read_result  # noqa: E402
from twin.rom.artefact import read_artefact  # noqa: E402
from twin.serve.finished_run import FinishedRun  # noqa: E402
from twin.serve.live_state import LiveState  # noqa: E402
from twin.serve.opcua import NAMESPACE, Access, OpcUaServer  # noqa: E402

APPLICATION = "urn:twin:tests"
DAY = datetime.timedelta(days=1)


def certificate(folder: Path, name: str, valid=(-DAY, 30 * DAY), use=ExtendedKeyUsageOID.CLIENT_AUTH) -> str:
    """Key and self-signed certificate of a client, valid between two times from now; for `set_security_string`."""
    key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
    now = datetime.datetime.now(datetime.UTC)
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    made = (
        x509.CertificateBuilder()
        .subject_name(subject).issuer_name(subject).public_key(key.public_key()).serial_number(x509.random_serial_number())
        .not_valid_before(now + valid[0]).not_valid_after(now + valid[1])
        .add_extension(x509.SubjectAlternativeName([x509.UniformResourceIdentifier(APPLICATION)]), critical=False)
        .add_extension(x509.KeyUsage(True, True, True, True, False, False, False, False, False), critical=True)
        .add_extension(x509.ExtendedKeyUsage([use]), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .sign(key, hashes.SHA256())
    )  # fmt: skip
    (folder / f"{name}.der").write_bytes(made.public_bytes(serialization.Encoding.DER))
    pem = serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    (folder / f"{name}.pem").write_bytes(key.private_bytes(*pem))
    return f"Basic256Sha256,SignAndEncrypt,{folder / name}.der,{folder / name}.pem"


def served(source, folder, work):
    """What `work(url)` gives while the server runs."""

    async def run():
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            url = f"opc.tcp://127.0.0.1:{s.getsockname()[1]}/twin"
        server = OpcUaServer(source.artefact, source, url, Access("twin", "right", folder))
        await server.start()
        try:
            return await work(url, server)
        finally:
            await server.stop()

    return asyncio.run(run())


async def client(url, security, user="twin", password="right") -> Client:
    made = Client(url, timeout=10)
    made.application_uri = APPLICATION
    if security:
        await made.set_security_string(security)
    if user:
        made.set_user(user)
        made.set_password(password)
    return made


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    """Of clients, and in `server` those that the first server makes."""
    return tmp_path_factory.mktemp("keys")


@pytest.fixture(scope="module")
def good(keys):
    return certificate(keys, "client")


@pytest.fixture(scope="module")
def finished(slide_artefact, slide_result):
    return FinishedRun(read_artefact(slide_artefact), slide_result)


def test_values_are_those_of_the_result_and_cannot_be_written(finished, slide_artefact, slide_result, keys, good):
    result = read_result(slide_result, read_artefact(slide_artefact))

    async def work(url, _):
        async with await client(url, good) as c:
            ns = await c.get_namespace_index(NAMESPACE)

            def node(name):
                return c.get_node(f"ns={ns};s={name}")

            plate = await node("temperatures.plate").read_data_value()
            assert plate.Value.Value == result.temperature[-1, result.sensors.index("plate")]
            assert plate.StatusCode.is_good()
            for k, component in enumerate("xyz"):
                assert await node(f"tcp_error.{component}").read_value() == result.tcp_actual[-1, k]
                at_poses = await node(f"tcp_error.at_poses.{component}").read_value()
                np.testing.assert_array_equal(at_poses, result.tcp[-1, :, k])
            np.testing.assert_array_equal(await node("tcp_error.poses.x").read_value(), result.poses[:, 0])
            assert (await node("health.trust").read_value()).split(":")[0] in ("yes", "no", "with care")
            unit = await (await node("temperatures.plate").get_child("0:EngineeringUnits")).read_value()
            assert (unit.UnitId, unit.DisplayName.Text) == (4408652, "°C")
            with pytest.raises(ua.UaError):
                await node("temperatures.plate").write_value(1.0)
            with pytest.raises(ua.UaError):
                await c.nodes.objects.add_folder(ns, "mine")
            assert await node("temperatures.plate").read_value() == plate.Value.Value
            root = await c.nodes.objects.get_child(f"{ns}:twin")
            names = {(await child.read_browse_name()).Name for child in await root.get_children()}
            assert names == {"machine", "temperatures", "tcp_error", "correction", "health"}

    served(finished, keys / "server", work)


@pytest.mark.long
def test_nobody_else_is_let_in(finished, keys, good):
    """Wrong password or user, certificates that are not valid, no encryption; and others are served on."""
    refused = [
        (good, *who) for who in (("twin", "wrong"), ("twin", ""), ("admin", "right"), ("Twin", "right"), ("", ""))
    ]
    refused += [
        (certificate(keys, name, (first * DAY, last * DAY), use), "twin", "right")
        for name, first, last, use in (
            ("expired", -20, -1, ExtendedKeyUsageOID.CLIENT_AUTH), ("early", 1, 20, ExtendedKeyUsageOID.CLIENT_AUTH),
            ("server", -1, 20, ExtendedKeyUsageOID.SERVER_AUTH),
        )
    ]  # fmt: skip
    refused.append(("", "twin", "right"))

    async def work(url, _):
        for security, user, password in refused:
            with pytest.raises((ua.UaError, ConnectionError)):
                async with await client(url, security, user, password):
                    pass
        async with await client(url, good):
            pass

    served(finished, keys / "server", work)


@pytest.mark.long
def test_only_trusted_certificates_are_taken_where_some_are_named(finished, keys, tmp_path, good):
    shutil.copytree(keys / "server", tmp_path, dirs_exist_ok=True)
    (tmp_path / "trusted").mkdir()
    (tmp_path / "trusted" / "client.der").write_bytes((keys / "client.der").read_bytes())
    stranger = certificate(keys, "stranger")

    async def work(url, _):
        async with await client(url, good):
            pass
        with pytest.raises((ua.UaError, ConnectionError)):
            async with await client(url, stranger):
                pass

    served(finished, tmp_path, work)


@pytest.mark.long
def test_a_running_machine_says_what_it_does_and_what_is_old(slide_artefact, state, keys, good):
    artefact = read_artefact(slide_artefact)
    live = LiveState(artefact, state)
    live.health = live.health | {"written": 1e12}  # of the future: not silent

    async def work(url, server):
        async with await client(url, good) as c:
            ns = await c.get_namespace_index(NAMESPACE)
            node = c.get_node(f"ns={ns};s=temperatures.plate")
            fresh = await node.read_data_value()
            assert fresh.StatusCode.is_good()
            assert await c.get_node(f"ns={ns};s=correction.mode").read_value() == live.health["mode"]
            actual = [await c.get_node(f"ns={ns};s=tcp_error.{k}").read_value() for k in "xyz"]
            assert np.isfinite(actual).all()
            live.health = live.health | {"written": 0.0}
            await server.update()
            old = await node.read_data_value(raise_on_bad_status=False)
            assert old.StatusCode.name == "UncertainLastUsableValue"
            assert old.Value.Value == fresh.Value.Value
            assert "has stopped" in await c.get_node(f"ns={ns};s=health.trust").read_value()

    served(live, keys / "server", work)


@pytest.mark.long
def test_before_the_first_step_values_are_waited_for(slide_artefact, tmp_path, keys, good):
    live = LiveState(read_artefact(slide_artefact), tmp_path)

    async def work(url, _):
        async with await client(url, good) as c:
            ns = await c.get_namespace_index(NAMESPACE)
            found = await c.get_node(f"ns={ns};s=temperatures.plate").read_data_value(raise_on_bad_status=False)
            assert found.StatusCode.name == "BadWaitingForInitialData"

    served(live, keys / "server", work)
