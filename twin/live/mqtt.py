"""MQTT 3.1.1: blocks of load records from a topic, corrections to another one (package paho-mqtt, extra `mqtt`).

A message is one block: a frame as in docs/load_blocks.md, or the same as JSON. The session is kept by the broker under
one client name, and a message is acknowledged only when its block is in the journal: what comes while this process is
dead, and what had not yet come that far, is delivered later (QoS 1), perhaps twice, which the numbers of the blocks
show. Messages of QoS 0 are lost then, which the numbers show, too.
"""

from __future__ import annotations

import json
import math
import queue
import socket
import sys
import zlib
from array import array
from collections.abc import Sequence
from typing import Any

from twin.errors import TwinError
from twin.live.block import Block, block_of
from twin.live.channels import Channels
from twin.live.facts import Facts
from twin.live.offsets import Form, Values
from twin.live.sinks import Sent, told_of, values_in
from twin.live.source import Mark
from twin.logs.frame import LATEST, Frame, frames
from twin.logs.resolver import Damaged
from twin.units import parse_unit

AGAIN = 5  # s at most between two attempts to connect
KEEPALIVE = 30  # s without a word after which a connection counts as lost
WAITING = 1000  # messages that were not asked for yet; the broker waits with more
LARGEST = 1e18  # a number of a block beyond it is none
RETAINED = 1.0  # s that a retained message may take to come


class _Connection:
    """A client of paho, which connects again by itself in a thread of its own."""

    def __init__(self, place: str, channels: Channels, name: str, keep: bool):
        """place: HOST[:PORT]/TOPIC. keep: the broker keeps the session under `name`.

        Raises TwinError where paho-mqtt is missing, the place has no topic, or a file that the channels file names.
        """
        try:
            import paho.mqtt.client as paho
        except ImportError as e:
            raise TwinError("the package paho-mqtt is missing", place, "python -m pip install 'twin[mqtt]'") from e
        at, _, self.topic = place.removeprefix("//").partition("/")
        host, _, port = at.partition(":")
        own = channels.mqtt
        if not host or not self.topic or not (port or "1883").isdecimal() or not 0 < int(port or "1883") < 65536:
            raise TwinError(f"'{place}' names no topic of a broker", "mqtt", "write mqtt:HOST:PORT/TOPIC")
        channels.refuse_missing("mqtt")
        self.error = f"{at} cannot be reached"
        self.client = paho.Client(paho.CallbackAPIVersion.VERSION2, name, clean_session=not keep, manual_ack=True)
        if "user" in own:
            secret = own.get("password_file")
            self.client.username_pw_set(
                own["user"], (channels.folder / secret).read_text("utf-8").strip() if secret else None
            )
        if "ca" in own:
            files = {k: str(channels.folder / own[k]) if k in own else None for k in ("ca", "certificate", "key")}
            try:
                self.client.tls_set(files["ca"], files["certificate"], files["key"])
            except (OSError, ValueError) as e:  # ssl.SSLError is an OSError
                remedy = "give files in PEM, the key to its certificate and without a password"
                raise TwinError(f"ca, certificate or key: {e}", "mqtt", remedy) from e
        self.client.reconnect_delay_set(1, AGAIN)
        self.client.on_connect = self._connected
        self.client.on_connect_fail = self._unreachable
        self.client.on_disconnect = self._lost
        self.subscribed = ""
        self._place = (host, int(port or ("8883" if "ca" in own else "1883")))

    def begin(self, subscribe: bool) -> None:
        self.subscribed = self.topic if subscribe else ""
        self.client.connect_async(*self._place, keepalive=KEEPALIVE)
        self.client.loop_start()

    def _connected(self, client: Any, _: Any, flags: Any, reason: Any, properties: Any) -> None:
        if reason.is_failure:
            self.error = f"refused: {reason}"
        elif self.subscribed:
            self.error = ""
            client.subscribe(self.subscribed, qos=1)
        else:
            self.error = ""

    def _unreachable(self, client: Any, _: Any) -> None:
        self.error = (
            f"{self._place[0]}:{self._place[1]} cannot be reached: {sys.exc_info()[1]}"  # called while it is handled
        )

    def _lost(self, client: Any, _: Any, flags: Any, reason: Any, properties: Any) -> None:
        self.error = self.error or f"connection lost: {reason}"

    def close(self) -> None:
        self.client.disconnect()
        self.client.loop_stop()


class MqttSource:
    """Blocks of one topic."""

    numbered = True
    speed = 1.0
    ended = False

    def __init__(self, place: str, channels: Channels):
        """place: HOST[:PORT]/TOPIC. Raises TwinError as the connection does."""
        name = channels.mqtt.get("client", f"twin-live-{zlib.crc32(f'{socket.gethostname()} {place}'.encode()):08x}")
        self._connection = _Connection(place, channels, name, keep=True)
        self._arrived: queue.Queue[Any] = queue.Queue(WAITING)
        self._taken: list[tuple[Any, Block | Damaged]] = []  # given out, not acknowledged
        self._connection.client.on_message = lambda client, _, message: self._arrived.put(message)

    def resume(self, mark: Mark | None) -> None:
        self._connection.begin(subscribe=True)

    @property
    def error(self) -> str:
        return self._connection.error

    def poll(self, wait: float) -> Sequence[Block | Damaged]:
        messages: list[Any] = []
        try:
            messages.append(self._arrived.get(timeout=wait))
            while len(messages) < WAITING:
                messages.append(self._arrived.get_nowait())
        except queue.Empty:
            pass
        found = [read_message(message.payload) for message in messages]
        self._taken += zip(messages, found, strict=True)
        return found

    def fetch(self, stream: int, numbers: Sequence[int]) -> Sequence[Block]:
        return ()

    def release(self, held: Sequence[Block]) -> None:
        waiting = {(block.stream, block.sequence) for block in held}
        before, self._taken = self._taken, []
        for message, block in before:
            if isinstance(block, Block) and (block.stream, block.sequence) in waiting:
                self._taken.append((message, block))
            else:
                self._connection.client.ack(message.mid, message.qos)

    def close(self) -> None:
        self._connection.close()


def read_message(payload: bytes) -> Block | Damaged:
    """The block of a message: a frame, or a JSON object of stream, sequence, time, interval, columns and records."""
    if payload[:1] == b"{":
        try:
            return _of_json(json.loads(payload))
        except (ValueError, TypeError, KeyError, OverflowError, RecursionError):
            return Damaged()
    found = next(iter(frames(payload)), Damaged())
    return block_of(found) if isinstance(found, Frame) and found.end_at == len(payload) else Damaged()


def _of_json(told: dict[str, Any]) -> Block:
    """Raises ValueError, TypeError, KeyError or OverflowError for anything that is no block."""
    names = tuple(name for name, _ in told["columns"])
    units = [parse_unit(unit) for _, unit in told["columns"]]
    stream, sequence = int(told["stream"]), int(told["sequence"])
    begin, interval = float(told["time"]), float(told["interval"])
    values = array("d")
    for record in told["records"]:
        for value, unit in zip(record, units, strict=True):
            values.append(math.nan if value is None else float(value) * unit.factor + unit.offset)
    named = names and len(set(names)) == len(names) and all(isinstance(n, str) and n.isprintable() for n in names)
    timed = abs(begin) < LATEST and 0.0 < interval * len(told["records"]) < LATEST - begin
    if not (named and values and timed and 0 <= stream < LARGEST and 0 <= sequence < LARGEST):
        raise ValueError("no block")
    return Block(stream, sequence, begin, interval, names, tuple(u.si for u in units), values)


class MqttSink:
    """JSON as of `twin.live.sinks.FileSink`, retained: who subscribes later has it at once."""

    def __init__(self, facts: Facts, form: Form, place: str, channels: Channels):
        """place: HOST[:PORT]/TOPIC. Raises TwinError as the connection does."""
        self.name, self.facts, self.form = f"mqtt:{place}", facts, form
        self._connection = _Connection(place, channels, "", keep=False)
        self._retained: queue.Queue[bytes] = queue.Queue(1)
        self._connection.client.on_message = self._message
        self._connection.begin(subscribe=True)

    def _message(self, client: Any, _: Any, message: Any) -> None:
        client.ack(message.mid, message.qos)
        client.unsubscribe(self._connection.topic)  # what follows is this process' own
        self._connection.subscribed = ""
        if not self._retained.full():
            self._retained.put(message.payload)

    def last(self) -> Values | None:
        try:
            return values_in(json.loads(self._retained.get(timeout=RETAINED)), self.facts, self.form)
        except (queue.Empty, ValueError):
            return None

    def write(self, sent: Sent) -> None:
        connection = self._connection
        if not connection.client.is_connected():
            raise ConnectionError(connection.error or "not connected")
        text = json.dumps(told_of(sent, self.facts, self.form))
        done = connection.client.publish(connection.topic, text, qos=0, retain=True)
        if done.rc:
            raise ConnectionError(f"not sent: error {done.rc}")

    def close(self) -> None:
        self._connection.close()
