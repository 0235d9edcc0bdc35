"""What the page shows, as nodes of an OPC UA server of its own namespace: read by any client, written by none.

Basic256Sha256, signed and encrypted, with user and password, always: there is no anonymous session and no other policy.
A client's certificate must be valid now, be of its application and for client authentication; where certificates lie in
`trusted/` of the key folder it must be one of these, or issued by one.
"""

from __future__ import annotations

import hmac
import logging
import math
import socket
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, cast
from urllib.parse import urlsplit

import numpy as np

from twin.errors import TwinError
from twin.page.machine import air_names
from twin.rom.artefact import Artefact
from twin.serve.now import Now, Source

NAMESPACE = "urn:twin:machine"
APPLICATION = "urn:twin:serve"
UNITS = "http://www.opcfoundation.org/UA/units/un/cefact"  # UNECE codes of units: OPC 10000-8, 5.6.3
TEXT = ("trust", "mode", "words")
NUMBERS = {"age": "SEC", "balance": "", "step": "", "time": "SEC"}


@dataclass(frozen=True)
class Access:
    """Who may read, and where keys and certificates lie."""

    user: str
    password: str
    folder: Path  # server.der and server.pem, made where they are missing; trusted/


class OpcUaServer:
    """All nodes are made at the start; `update` writes what has changed."""

    def __init__(self, artefact: Artefact, source: Source, url: str, access: Access):
        """Raises TwinError where asyncua is missing, or for other addresses."""
        try:
            import asyncua  # noqa: F401
        except ImportError as e:
            raise TwinError("the package asyncua is missing", url, "python -m pip install 'twin[serve]'") from e
        try:
            parts = urlsplit(url)
            sound = parts.scheme == "opc.tcp" and parts.hostname is not None and parts.port is not None
        except ValueError:
            sound = False
        if not sound:
            raise TwinError("is no address of an OPC UA server", url, "write --opcua opc.tcp://127.0.0.1:4840/twin")
        self.artefact, self.source, self.url, self.access = artefact, source, url, access
        self._nodes: dict[str, Any] = {}
        self._last: object = None

    async def start(self) -> None:
        """Raises TwinError where the port is taken or the keys cannot be used."""
        import asyncua

        ua = _ua()

        logging.getLogger("asyncua").setLevel(logging.CRITICAL)  # a refused client is no event of ours
        self._server: Any = asyncua.Server(user_manager=cast(Any, _Users(self.access)))
        await self._server.init()
        await self._server.set_application_uri(APPLICATION)
        self._server.set_server_name("twin serve")
        self._server.set_endpoint(self.url)
        policy = [ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt]
        self._server.set_security_policy(policy, permission_ruleset=cast(Any, _Reading()))
        self._server.set_identity_tokens([ua.UserNameIdentityToken])
        await self._keys()
        await self._build()
        await self.update()
        try:
            await self._server.start()
        except OSError as e:
            raise TwinError(f"cannot listen: {e.strerror or e}", self.url, "name another port") from e

    async def _keys(self) -> None:
        from asyncua.crypto.cert_gen import setup_self_signed_certificate
        from asyncua.crypto.truststore import TrustStore
        from asyncua.crypto.validator import CertificateValidator, CertificateValidatorOptions
        from cryptography.x509.oid import ExtendedKeyUsageOID

        folder = self.access.folder
        key, certificate, trusted = folder / "server.pem", folder / "server.der", folder / "trusted"
        options = CertificateValidatorOptions.EXT_VALIDATION | CertificateValidatorOptions.PEER_CLIENT
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            await setup_self_signed_certificate(
                key, certificate, APPLICATION, socket.gethostname(), [ExtendedKeyUsageOID.SERVER_AUTH],
                {"commonName": "twin serve"},
            )  # fmt: skip
            key.chmod(0o600)
            await self._server.load_certificate(str(certificate))
            await self._server.load_private_key(str(key))
            store = None
            if trusted.is_dir() and any(trusted.iterdir()):
                store = TrustStore([trusted], [])
                await store.load()
                options |= CertificateValidatorOptions.TRUSTED
        except (OSError, ValueError) as e:
            raise TwinError(f"keys cannot be used: {e}", str(folder), "name another folder with --pki") from e
        self._server.set_certificate_validator(CertificateValidator(options, store))

    # ---- nodes ----

    async def _build(self) -> None:
        ua = _ua()

        self._index = await self._server.register_namespace(NAMESPACE)
        model = self.artefact.model
        root = await self._folder(self._server.nodes.objects, "twin")
        about = await self._folder(root, "machine")
        for name, value in (("name", model.name), ("artefact", self.artefact.digest)):
            await about.add_variable(self._id(f"machine.{name}"), name, value, ua.VariantType.String)
        group = await self._folder(root, "temperatures")
        for name in (*model.sensors, *air_names(self.artefact)):
            await self._number(group, f"temperatures.{name}", name, "CEL")
        group = await self._folder(root, "tcp_error")
        if model.moves:
            for component in "xyz":
                await self._number(group, f"tcp_error.{component}", component, "MTR")
                await self._number(group, f"tcp_error.at_poses.{component}", f"{component}_at_poses", "MTR", array=True)
            count = len(model.poses) - model.scattered
            for axis, column in zip(model.pose_axes, model.poses[:count].T, strict=True):
                node = await group.add_variable(
                    self._id(f"tcp_error.poses.{axis}"), f"pose_{axis}", column.tolist(), ua.VariantType.Double
                )
                await self._unit(node, "MTR")
        group = await self._folder(root, "correction")
        for axis in model.pose_axes:
            await self._number(group, f"correction.largest.{axis}", f"largest_{axis}", "MTR")
        for name in ("mode", "words"):
            await self._text(group, f"correction.{name}", name)
        group = await self._folder(root, "health")
        await self._text(group, "health.trust", "trust")
        self._nodes["health.flags"] = await group.add_variable(
            self._id("health.flags"), "flags", [], ua.VariantType.String
        )
        for name, unit in NUMBERS.items():
            await self._number(group, f"health.{name}", name, unit)

    def _id(self, name: str) -> str:
        return f"ns={self._index};s={name}"

    async def _folder(self, parent: Any, name: str) -> Any:
        return await parent.add_folder(self._id(f"folder.{name}"), f"{self._index}:{name}")

    async def _text(self, parent: Any, key: str, name: str) -> None:
        ua = _ua()

        self._nodes[key] = await parent.add_variable(self._id(key), name, "", ua.VariantType.String)

    async def _number(self, parent: Any, key: str, name: str, unit: str, array: bool = False) -> None:
        ua = _ua()

        value: Any = [] if array else math.nan
        self._nodes[key] = await parent.add_variable(self._id(key), name, value, ua.VariantType.Double)
        if unit:
            await self._unit(self._nodes[key], unit)

    async def _unit(self, node: Any, code: str) -> None:
        """EngineeringUnits: the UNECE code, and its number as OPC 10000-8 makes it of the letters."""
        ua = _ua()

        shown = {"CEL": "°C", "MTR": "m", "SEC": "s"}[code]
        unit = ua.EUInformation(
            NamespaceUri=UNITS, UnitId=int.from_bytes(code.encode(), "big"), DisplayName=ua.LocalizedText(shown)
        )
        await node.add_property(ua.NodeId(f"{node.nodeid.Identifier}.unit", self._index), "0:EngineeringUnits", unit)

    # ---- values ----

    async def update(self) -> None:
        """Write the newest values, stamped with the time of the step; old ones are uncertain, missing ones bad."""
        ua = _ua()

        now = self.source.now()
        if now is None:
            await self._without(ua.StatusCodes.BadWaitingForInitialData)
            return
        stamp = datetime.fromtimestamp(now.time, UTC) if now.mode != "finished" else datetime.now(UTC)
        old = now.trust.startswith("no")
        status = ua.StatusCodes.UncertainLastUsableValue if old else ua.StatusCodes.Good
        for key, value in values_of(now, (*self.artefact.model.sensors, *air_names(self.artefact))).items():
            if (node := self._nodes.get(key)) is None:
                continue
            kind = ua.VariantType.String if isinstance(value, str) or key == "health.flags" else ua.VariantType.Double
            own = ua.StatusCode(ua.StatusCodes.Good if key.startswith(("health", "correction")) else status)
            data = ua.DataValue(ua.Variant(value, kind), own, SourceTimestamp=stamp.replace(tzinfo=None))
            await self._server.write_attribute_value(node.nodeid, data)

    async def fail(self) -> None:
        """No value is known: better none than one that stands still and looks good."""
        await self._without(_ua().StatusCodes.BadInternalError)

    async def _without(self, status: int) -> None:
        ua = _ua()
        for node in self._nodes.values():
            await self._server.write_attribute_value(node.nodeid, ua.DataValue(StatusCode=ua.StatusCode(status)))

    async def stop(self) -> None:
        await self._server.stop()


def values_of(now: Now, sensors: tuple[str, ...]) -> dict[str, Any]:
    """Values by the names of nodes, SI and degC."""
    found: dict[str, Any] = {f"temperatures.{n}": v for n, v in zip(sensors, now.temperatures, strict=True)}
    for k, component in enumerate("xyz"):
        found[f"tcp_error.{component}"] = float(now.actual[k])
        found[f"tcp_error.at_poses.{component}"] = np.asarray(now.tcp[:, k]).tolist()
    found |= {f"correction.largest.{axis}": value for axis, value in now.largest.items()}
    found |= {"correction.mode": now.mode, "correction.words": now.words, "health.trust": now.trust}
    found |= {"health.flags": list(now.flags), "health.age": now.age, "health.balance": now.balance}
    return found | {"health.step": float(now.step), "health.time": now.time}


class _Reading:
    """What a session may ask for: no write, no call, no change of nodes."""

    def __init__(self) -> None:
        from asyncua.crypto.permission_rules import USER_TYPES, UserRole

        ua = _ua()
        refused = (ua.ObjectIds.WriteRequest_Encoding_DefaultBinary, ua.ObjectIds.CallRequest_Encoding_DefaultBinary)
        self._role = UserRole.User
        self._allowed = frozenset(ua.NodeId(t) for t in USER_TYPES if t not in refused)  # once, not at every request

    def check_validity(self, user: Any, action_type: Any, body: Any) -> bool:
        return user.role == self._role and action_type in self._allowed


class _Users:
    """One user with a password, who may read."""

    def __init__(self, access: Access):
        self._access = access

    def get_user(self, iserver: Any, username: Any = None, password: Any = None, certificate: Any = None) -> Any:
        from asyncua.crypto.permission_rules import User, UserRole

        given = password.decode("utf-8", "replace") if isinstance(password, bytes) else password
        if not isinstance(username, str) or not isinstance(given, str):
            return None
        same = [
            hmac.compare_digest(a.encode("utf-8", "replace"), b.encode("utf-8"))
            for a, b in ((username, self._access.user), (given, self._access.password))
        ]
        return User(role=UserRole.User, name=username) if all(same) else None


def _ua() -> Any:
    """asyncua's types; it is imported where a server is made, for `twin serve` does without one."""
    from asyncua import ua

    return ua
