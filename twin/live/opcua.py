"""OPC UA: signals read from a server's nodes, corrections written to them (package asyncua, extra `live`).

Nodes are read at equal intervals rather than subscribed to: a subscription delivers on change only, and silence then
means "unchanged" or "lost". A value counts only with a good status code; a heartbeat node that stands still for
HEARTBEAT makes all values missing. The gap of a lost connection is lost: a server keeps no blocks.
"""

from __future__ import annotations

import logging
import math
import time
from array import array
from collections.abc import Mapping, Sequence
from concurrent.futures import CancelledError
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from twin.errors import TwinError
from twin.live.block import Block
from twin.live.channels import Channels
from twin.live.cnc import nodes_by_default
from twin.live.facts import Facts
from twin.live.offsets import Values
from twin.live.sinks import Sent
from twin.live.source import Mark
from twin.logs.resolver import Damaged
from twin.units import parse_unit, to_si

AGAIN = 2.0  # s between two attempts to connect
HEARTBEAT = 5.0  # s
TIMEOUT = 4.0  # s of a request
RECORDS = 10  # of a block
_LOST = (OSError, TimeoutError, CancelledError, RuntimeError)


class Connection:
    """A client that connects again by itself, at most every AGAIN seconds."""

    def __init__(self, url: str, channels: Channels):
        """Raises TwinError where asyncua is missing, or the certificate, key or password file."""
        try:
            import asyncua.sync
        except ImportError as e:
            raise TwinError("the package asyncua is missing", url, "python -m pip install 'twin[live]'") from e
        logging.getLogger("asyncua").setLevel(logging.CRITICAL)  # a line per attempt, for as long as a server is away
        self.url, self.channels, self._api = url, channels, asyncua.sync
        self._client: Any = None
        self.error = f"{url} cannot be reached"
        self._tried = -math.inf
        own = channels.opcua
        channels.refuse_missing("opcua")
        for key in ("certificate", "server_certificate"):
            if key in own:
                _refuse_expired(channels.folder / own[key], key)

    def client(self) -> Any:
        """Connected, or OSError."""
        if self._client is not None:
            return self._client
        if time.monotonic() - self._tried < AGAIN:
            raise ConnectionError(self.error or f"{self.url} cannot be reached")
        self._tried = time.monotonic()
        client = self._api.Client(self.url, timeout=TIMEOUT)
        own = self.channels.opcua
        try:
            if "certificate" in own:
                keys = [k for k in ("certificate", "key", "server_certificate") if k in own]
                paths = ",".join(str(self.channels.folder / own[k]) for k in keys)
                client.set_security_string(f"Basic256Sha256,SignAndEncrypt,{paths}")
                client.aio_obj.certificate_validator = _server_validator()
            if "user" in own:
                client.set_user(own["user"])
                client.set_password((self.channels.folder / own["password_file"]).read_text("utf-8").strip())
            client.connect()
        except Exception as e:  # refused, wrong password, certificate: whatever it is, it is tried again
            self._drop(client)
            self.error = f"{self.url}: {type(e).__name__} {e}"[:200]
            raise ConnectionError(self.error) from e
        self._client, self.error = client, ""
        return client

    def lose(self) -> None:
        """After a request that failed."""
        client, self._client = self._client, None
        if client is not None:
            self._drop(client)

    def _drop(self, client: Any) -> None:
        try:
            client.disconnect()
        except Exception:
            client.tloop.stop()


def _server_validator() -> Any:
    """Of a server's certificate: its time; whose it is says `server_certificate`."""
    from asyncua.crypto.validator import CertificateValidator, CertificateValidatorOptions

    own = CertificateValidatorOptions.TIME_RANGE | CertificateValidatorOptions.PEER_SERVER
    return CertificateValidator(own).validate


def _refuse_expired(path: Path, key: str) -> None:
    """Raises TwinError for a file that is no certificate, or one that is not valid now."""
    from cryptography import x509

    data = path.read_bytes()
    try:
        found = (x509.load_pem_x509_certificate if b"-----BEGIN" in data else x509.load_der_x509_certificate)(data)
    except ValueError as e:
        raise TwinError(f"{key}: no certificate", str(path), "give one in DER or PEM") from e
    begin, end, now = found.not_valid_before_utc, found.not_valid_after_utc, datetime.now(UTC)
    if not begin <= now <= end:
        what = f"{key}: valid from {begin:%Y-%m-%d} to {end:%Y-%m-%d}, which is not now"
        raise TwinError(what, str(path), "make a new one, and let the server trust it; or set the clock")


def _refuse_no_nodes(texts: Sequence[str]) -> None:
    """Raises TwinError for a text that names no node."""
    from asyncua import ua

    for text in texts:
        try:
            ua.NodeId.from_string(text)
        except ua.UaError as e:
            raise TwinError(f"'{text}' names no node", "channels file", "write node = 'ns=2;s=NAME'") from e


class OpcUaSource:
    """Nodes of a server at equal intervals."""

    numbered = True
    speed = 1.0
    ended = False

    def __init__(self, url: str, channels: Channels, facts: Facts):
        """Raises TwinError where neither the channels file nor a server that can be reached tells the nodes needed."""
        self._connection = Connection(url, channels)
        self.interval = to_si(channels.opcua.get("interval", "0.1 s"), "s")
        self._channels, self._facts, self._wrong = channels, facts, ""
        _refuse_no_nodes([node for node, _ in channels.nodes.values()])
        self._by_default = any(
            c.needed and c.default is None and c.column not in channels.nodes for c in facts.channels
        )
        self._read(channels.nodes)
        if self._by_default:
            try:
                self._read(channels.nodes | nodes_by_default(self._connection.client(), facts, channels))
            except TwinError:
                self._connection.lose()
                raise
            except _LOST:  # later, then
                self._connection.lose()
        self._beat = channels.opcua.get("heartbeat")
        self._last_beat: tuple[object, float] = (None, time.monotonic())
        self._nodes: list[Any] = []
        self._stream, self._sequence = 0, 0
        self._next = 0.0  # s, POSIX: when the next record is due
        self._first = 0.0
        self._rows: array[float] = array("d")

    def _read(self, nodes: Mapping[str, tuple[str, str]]) -> None:
        """From now on these: column -> node, unit."""
        self.names = tuple(nodes)
        self._units = [parse_unit(unit) for _, unit in nodes.values()]
        self.units = tuple(u.si for u in self._units)
        self._ids = [node for node, _ in nodes.values()]

    def resume(self, mark: Mark | None) -> None:
        return

    def fetch(self, stream: int, numbers: Sequence[int]) -> Sequence[Block]:
        return ()

    def release(self, held: Sequence[Block]) -> None:
        return

    @property
    def error(self) -> str:
        return self._connection.error or self._wrong

    def poll(self, wait: float) -> Sequence[Block | Damaged]:
        until = time.time() + wait
        while time.time() < until:
            try:
                self._record()
            except _LOST:
                self._connection.lose()
                self._nodes = []
                time.sleep(max(min(0.1, until - time.time()), 0.0))
                continue
            if len(self._rows) >= RECORDS * len(self.names):
                return [self._block()]
        return []

    def _record(self) -> None:
        client = self._connection.client()
        if not self._nodes:  # connected anew: what was missed is a gap, which another stream shows
            if self._by_default:
                self._find(client)
            ids = [*self._ids, self._beat] if self._beat else self._ids
            self._nodes = [client.get_node(i) for i in ids]
            self._stream, self._sequence, self._rows = time.time_ns(), 0, array("d")
            self._first = self._next = time.time()
        time.sleep(max(self._next - time.time(), 0.0))
        if time.time() - self._next > 5.0 * self.interval:  # this process was held up: what it missed is a gap
            self._nodes = []
            return
        found = client.read_attributes(self._nodes)
        values = [self._value(v) for v in found]
        if self._beat and self._silent(values.pop()):
            values = [math.nan] * len(self.names)
        self._rows.extend(v * u.factor + u.offset for v, u in zip(values, self._units, strict=True))
        self._next += self.interval

    def _find(self, client: Any) -> None:
        """Nodes by default, which a server may call otherwise since it was started anew. Raises ConnectionError."""
        try:
            self._read(self._channels.nodes | nodes_by_default(client, self._facts, self._channels))
        except TwinError as e:  # it may be starting still: no reason to end
            self._wrong = e.problems[0].what
            raise ConnectionError(self._wrong) from e
        self._wrong = ""

    def _value(self, found: Any) -> float:
        if found.StatusCode is not None and not found.StatusCode.is_good():
            return math.nan
        try:
            return float(found.Value.Value)
        except (TypeError, ValueError, AttributeError):
            return math.nan

    def _silent(self, beat: float) -> bool:
        now = time.monotonic()
        if beat != self._last_beat[0] and not math.isnan(beat):
            self._last_beat = (beat, now)
        return now - self._last_beat[1] > HEARTBEAT

    def _block(self) -> Block:
        block = Block(self._stream, self._sequence, self._first, self.interval, self.names, self.units, self._rows)
        self._sequence += 1
        self._first += block.records * self.interval
        self._rows = array("d")
        return block

    def close(self) -> None:
        self._connection.lose()


class OpcUaSink:
    """Arrays of offsets, a heartbeat, a time and a mode, as nodes that the channels file names."""

    def __init__(self, facts: Facts, url: str, channels: Channels):
        """Raises TwinError where the file names no node for the offsets."""
        self.name, self.facts, self._out = f"opcua:{url}", facts, channels.outputs
        if "{axis}" not in channels.outputs.get("offsets", ""):
            raise TwinError("no node for the offsets", url, "write [outputs] offsets = 'ns=2;s=offset_{axis}'")
        self._connection = Connection(url, channels)
        _refuse_no_nodes([text.replace("{axis}", "x") for text in channels.outputs.values()])

    def last(self) -> Values | None:
        try:
            client = self._connection.client()
            found = [client.get_node(self._out["offsets"].format(axis=a.name)).read_value() for a in self.facts.axes]
            return tuple(tuple(float(v) for v in values) for values in found) if all(found) else None
        except (*_LOST, TypeError, ValueError):
            self._connection.lose()
            return None

    def write(self, sent: Sent) -> None:
        from asyncua import ua

        double = ua.VariantType.Double
        wanted: list[tuple[str, Any, Any]] = [
            (self._out["offsets"].format(axis=a.name), list(v), double)
            for a, v in zip(self.facts.axes, sent.values, strict=True)
        ]
        for key, value, kind in (("count", sent.count, ua.VariantType.Int64), ("good_until", sent.good_until, double),
                                 ("mode", sent.mode, ua.VariantType.String)):  # fmt: skip
            if key in self._out:
                wanted.append((self._out[key], value, kind))
        try:
            client = self._connection.client()
            nodes = [client.get_node(node) for node, _, _ in wanted]
            values = [ua.DataValue(ua.Variant(value, kind)) for _, value, kind in wanted]
            client.write_values(nodes, values)
        except _LOST as e:
            self._connection.lose()
            raise ConnectionError(f"{type(e).__name__} {e}"[:200]) from e

    def close(self) -> None:
        self._connection.lose()
