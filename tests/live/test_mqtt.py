"""MQTT with a real broker (mosquitto) on 127.0.0.1."""

from __future__ import annotations

import json
import math
import shutil
import socket
import subprocess
import time
from array import array

import pytest

paho = pytest.importorskip("paho.mqtt.client")
pytest.importorskip("cryptography")

from tests.live.scripted import FACTS, NAMES, UNITS, Kept, runtime  # noqa: E402
from tests.support.authority import authority  # noqa: E402
from twin.errors import TwinError  # noqa: E402
from twin.live.block import Block, frame_of  # noqa: E402
from twin.live.channels import Channels, read_channels  # noqa: E402
from twin.live.journal import Position  # noqa: E402
from twin.live.mqtt import MqttSink, MqttSource, read_message  # noqa: E402
from twin.live.sinks import Sent  # noqa: E402
from twin.live.source import Mark  # noqa: E402
from twin.logs.frame import packed  # noqa: E402
from twin.logs.resolver import Damaged  # noqa: E402

MOSQUITTO = shutil.which("mosquitto") or shutil.which("/usr/sbin/mosquitto")
pytestmark = pytest.mark.skipif(MOSQUITTO is None, reason="no mosquitto")
BEGIN = 1.7e9


class Broker:
    """A broker in a process of its own, which keeps sessions over its own death."""

    def __init__(self, folder, lines=""):
        self.folder = folder
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            self.port = s.getsockname()[1]
        subprocess.run(["mosquitto_passwd", "-b", "-c", "users", "twin", "right"], cwd=folder, check=True)
        (folder / "broker.conf").write_text(
            f"listener {self.port} 127.0.0.1\npassword_file {folder}/users\npersistence true\n"
            f"persistence_location {folder}/\nuser root\n{lines}"
        )
        self.start()

    def start(self):
        self.process = subprocess.Popen([MOSQUITTO, "-c", "broker.conf"], cwd=self.folder, stderr=subprocess.DEVNULL)
        for _ in range(100):
            with socket.socket() as s:
                if s.connect_ex(("127.0.0.1", self.port)) == 0:
                    return
            time.sleep(0.05)
        raise AssertionError("the broker does not listen")

    def stop(self):
        self.process.terminate()
        self.process.wait(10)

    def channels(self, password="right", more="") -> Channels:
        (self.folder / "channels.toml").write_text('[mqtt]\nuser = "twin"\npassword_file = "secret"\n' + more)
        (self.folder / "secret").write_text(password + "\n")
        return read_channels(self.folder / "channels.toml", FACTS)

    def sender(self, ca=None):
        client = paho.Client(paho.CallbackAPIVersion.VERSION2)
        if ca:
            client.tls_set(ca)
        client.username_pw_set("twin", "right")
        client.connect("127.0.0.1", self.port)
        client.loop_start()
        return client


@pytest.fixture
def broker(tmp_path):
    made = Broker(tmp_path)
    yield made
    made.stop()


def block(k, stream=7):
    values = array("d", [v for _ in range(10) for v in (0.25, 7.0, 21.5)])
    return Block(stream, k, BEGIN + 10.0 * k, 1.0, NAMES, UNITS, values)


def send(client, topic, *numbers):
    for k in numbers:
        client.publish(topic, packed(frame_of(block(k))), qos=1).wait_for_publish(10)


def polled(source, wanted, seconds=15.0):
    found, until = [], time.monotonic() + seconds
    while len(found) < wanted and time.monotonic() < until:
        found += source.poll(0.3)
    return found


def test_frames_and_json_are_blocks_and_anything_else_is_damaged():
    assert read_message(packed(frame_of(block(3)))) == block(3)
    told = {"stream": 7, "sequence": 3, "time": BEGIN, "interval": 1.0,
            "columns": [["x_position", "mm"], ["air", "degC"]], "records": [[250.0, 21.5], [None, 21.0]]}  # fmt: skip
    found = read_message(json.dumps(told).encode())
    assert (found.units, list(found.values[:2]), found.records) == (("m", "degC"), [0.25, 21.5], 2)
    assert math.isnan(found.values[2])
    sound = packed(frame_of(block(3)))
    for wrong in (b"", b"{}", b"[]", b"{", b"\xff", sound[:-1], sound + b"x", sound.replace(b"air", b"ajr"),
                  json.dumps(told | {"interval": 0}).encode(), json.dumps(told | {"sequence": -1}).encode(),
                  json.dumps(told | {"records": [[1.0]]}).encode(), json.dumps(told | {"time": 1e300}).encode(),
                  json.dumps(told | {"columns": [["a", "nonsense"], ["b", "m"]]}).encode()):  # fmt: skip
        assert isinstance(read_message(wrong), Damaged), wrong


@pytest.mark.long
def test_blocks_arrive_and_what_came_while_nobody_listened_comes_later(broker, tmp_path):
    place, client = f"127.0.0.1:{broker.port}/machine/loads", broker.sender()
    first = MqttSource(place, broker.channels())
    first.resume(None)
    assert polled(first, 1, 2.0) == []
    send(client, "machine/loads", 0, 1)
    assert [b.sequence for b in polled(first, 2)] == [0, 1]
    first.release(())  # both are in the journal
    first.close()
    send(client, "machine/loads", 2, 3)
    broker.stop()
    broker.start()  # the session outlives the broker
    time.sleep(0.5)
    client.reconnect()
    second = MqttSource(place, broker.channels())
    second.resume(Mark(7, 1))
    send(client, "machine/loads", 4)
    assert [b.sequence for b in polled(second, 3)] == [2, 3, 4]
    assert second.poll(0.2) == []
    second.close()
    client.loop_stop()


@pytest.mark.long
def test_what_was_taken_but_is_not_in_the_journal_comes_again(broker):
    place, client = f"127.0.0.1:{broker.port}/loads", broker.sender()
    killed = MqttSource(place, broker.channels())
    killed.resume(None)
    polled(killed, 1, 1.0)
    send(client, "loads", 0, 2)
    assert [b.sequence for b in polled(killed, 2)] == [0, 2]
    killed.release((block(2),))  # it waits for block 1
    time.sleep(0.3)
    killed._connection.client.loop_stop()  # dies
    killed._connection.client._sock_close()
    after = MqttSource(place, broker.channels())
    after.resume(None)
    assert [b.sequence for b in polled(after, 2, 3.0)] == [2]
    after.close()
    client.loop_stop()


def running(broker, folder):
    """A sender, and a process that takes blocks from a source."""
    source = MqttSource(f"127.0.0.1:{broker.port}/loads", broker.channels())
    made = runtime(folder / "state", source, Kept())
    made.begin(True)
    made.once(1.0)
    return broker.sender(), source, made


def test_blocks_that_wait_for_a_missing_one_are_not_acknowledged(broker, tmp_path):
    client, source, made = running(broker, tmp_path)
    send(client, "loads", 0, 2, 3, 0)
    until = time.monotonic() + 15.0
    while made.resolver.counts.repeated < 1 and time.monotonic() < until:
        made.once(0.3)
    assert [b.sequence for _, b in source._taken] == [2, 3]
    send(client, "loads", 1)
    while made.resolver.counts.delivered < 4 and time.monotonic() < until:
        made.once(0.3)
    assert source._taken == []
    assert [b.sequence for b in made.journal.since(Position(0, 0))] == [0, 1, 2, 3]
    made.close()
    client.loop_stop()


@pytest.mark.long
def test_a_wrong_password_is_refused(broker):
    source = MqttSource(f"127.0.0.1:{broker.port}/loads", broker.channels("wrong"))
    source.resume(None)
    assert polled(source, 1, 2.0) == []
    assert "refused: Not authorized" in source._connection.error
    source.close()
    sink = MqttSink(FACTS, "grid", f"127.0.0.1:{broker.port}/out", broker.channels("wrong"))
    assert sink.last() is None
    with pytest.raises(ConnectionError, match="Not authorized"):
        sink.write(Sent(1, 1e9, 1e9 + 5.0, "following", "", ((1e-6, 2e-6, 3e-6),)))
    sink.close()


def test_a_correction_is_retained_and_gone_on_from(broker):
    place = f"127.0.0.1:{broker.port}/machine/offsets"
    sink = MqttSink(FACTS, "grid", place, broker.channels())
    assert sink.last() is None
    for count in (1, 2):
        sink.write(Sent(count, 1e9, 1e9 + 5.0, "following", "", ((count * 1e-6, 2e-6, 3e-6),)))
    time.sleep(0.3)
    sink.close()
    again = MqttSink(FACTS, "grid", place, broker.channels())
    assert again.last() == ((2e-6, 2e-6, 3e-6),)
    again.close()
    other = MqttSink(FACTS, "polynomial", place, broker.channels())
    assert other.last() is None
    other.close()


def test_the_process_counts_lost_and_repeated_blocks(broker, tmp_path):
    client, _, made = running(broker, tmp_path)
    send(client, "loads", 0, 1, 1, 3, 2, 9, 10, 11, 12, 13)
    client.publish("loads", b"no block", qos=1).wait_for_publish(10)
    until = time.monotonic() + 15.0
    while (made.resolver.counts.damaged < 1 or made.intake.records < 90) and time.monotonic() < until:
        made.once(0.3)
    counts = made.resolver.counts
    assert (counts.lost, counts.repeated, counts.reordered, counts.damaged) == (5, 1, 1, 1)
    made.close()
    client.loop_stop()


def test_a_place_without_a_topic_is_refused():
    with pytest.raises(TwinError, match="names no topic of a broker"):
        MqttSource("127.0.0.1:1883", Channels())
    with pytest.raises(TwinError, match="names no topic of a broker"):
        MqttSource("127.0.0.1:99999/loads", Channels())


@pytest.fixture
def encrypted(tmp_path):
    for name in ("plant", "stranger"):
        authority(tmp_path, name)
    made = Broker(tmp_path, f"certfile {tmp_path}/plant-host.pem\nkeyfile {tmp_path}/plant-host.key\n")
    yield made
    made.stop()


def test_blocks_and_corrections_go_encrypted_with_a_password(encrypted, tmp_path):
    place, client = f"127.0.0.1:{encrypted.port}", encrypted.sender(str(tmp_path / "plant.pem"))
    channels = encrypted.channels(more='ca = "plant.pem"\n')
    source = MqttSource(f"{place}/loads", channels)
    source.resume(None)
    polled(source, 1, 1.0)
    send(client, "loads", 0)
    assert polled(source, 1) == [block(0)]
    assert source.error == ""
    source.close()
    for count in (1, 2):
        sink = MqttSink(FACTS, "grid", f"{place}/offsets", channels)
        assert sink.last() == (None if count == 1 else ((1e-6, 2e-6, 3e-6),))
        sink.write(Sent(count, 1e9, 1e9 + 5.0, "following", "", ((count * 1e-6, 2e-6, 3e-6),)))
        time.sleep(0.3)
        sink.close()
    client.loop_stop()


@pytest.mark.parametrize(
    ("password", "more", "told"),
    [
        ("right", 'ca = "stranger.pem"\n', "CERTIFICATE_VERIFY_FAILED"),
        ("wrong", 'ca = "plant.pem"\n', "refused: Not authorized"),
        ("right", "", "cannot be reached"),  # not encrypted
    ],
)
def test_a_broker_of_another_authority_a_wrong_password_and_no_encryption_are_refused(encrypted, password, more, told):
    source = MqttSource(f"127.0.0.1:{encrypted.port}/loads", encrypted.channels(password, more))
    source.resume(None)
    assert polled(source, 1, 2.5) == []
    assert told in source.error
    source.close()
    with pytest.raises(TwinError, match="ca, certificate or key"):
        MqttSource("127.0.0.1:1/loads", encrypted.channels(more='ca = "secret"\n'))
