"""Where blocks come from: one small interface, and what a user writes to name one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from twin.errors import TwinError
from twin.live.block import Block
from twin.live.channels import Channels
from twin.live.facts import Facts
from twin.logs.resolver import Damaged


@dataclass(frozen=True)
class Mark:
    """The last block that is in the journal."""

    stream: int
    sequence: int


class Source(Protocol):
    """Blocks of load records, in any order, perhaps twice or not at all."""

    numbered: bool  # the numbers of blocks show whether one is missing
    speed: float  # times real time; 0: as fast as they are taken
    ended: bool  # nothing more will come

    @property
    def error(self) -> str:
        """Why nothing can come now; empty where something can."""

    def resume(self, mark: Mark | None) -> None:
        """Go on after the last block of the journal, as far as what came since is stored; None: from the beginning.

        Called once, before `poll`.
        """

    def poll(self, wait: float) -> Sequence[Block | Damaged]:
        """What has arrived since, after `wait` [s] at the latest; a source that is away gives nothing."""

    def fetch(self, stream: int, numbers: Sequence[int]) -> Sequence[Block]:
        """Those of these blocks that are stored at the source."""

    def release(self, held: Sequence[Block]) -> None:
        """All that was given out is in the journal or was left out for good, but for `held`, which waits."""

    def close(self) -> None: ...


KINDS = "csv:LOADS.CSV, replay:RUN, ring:FILE, mqtt:HOST:PORT/TOPIC, opcua:opc.tcp://HOST:PORT"


def open_source(text: str, speed: float, channels: Channels, facts: Facts) -> Source:
    """The source that `text` names: kind:place. channels: of the channels file, for OPC UA and MQTT.

    Raises TwinError for other kinds, and LogError for files that cannot be read.
    """
    kind, colon, place = text.partition(":")
    if not colon or not place:
        raise TwinError(f"'{text}' names no source", "--source", f"write one of {KINDS}")
    if kind == "csv":
        from twin.live.csv_source import CsvSource

        return CsvSource(Path(place))
    if kind == "replay":
        from twin.live.csv_source import replay_of

        return replay_of(Path(place), speed)
    if kind == "ring":
        from twin.live.ring_source import RingSource

        return RingSource(Path(place))
    if kind == "opcua":
        from twin.live.opcua import OpcUaSource

        return OpcUaSource(place, channels, facts)
    if kind == "mqtt":
        from twin.live.mqtt import MqttSource

        return MqttSource(place, channels)
    raise TwinError(f"no source '{kind}'", "--source", f"write one of {KINDS}")
