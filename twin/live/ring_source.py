"""Blocks from a ring in shared memory (`twin.live.ring`), which is a store of its newest ones too."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

from twin.errors import TwinError
from twin.live.block import Block
from twin.live.ring import RingReader
from twin.live.source import Mark
from twin.logs.resolver import Damaged

LOOK = 0.002  # s between two looks: a hundredth of a core, and less than the model takes for a step


class RingSource:
    """What another process writes into a ring, from where the journal ends."""

    numbered = True
    speed = 1.0
    ended = False

    def __init__(self, path: Path):
        self.path = path
        self._reader: RingReader | None = None
        self._at: tuple[int, int] | None = None  # stream and number of the block to come

    def resume(self, mark: Mark | None) -> None:
        self._at = None if mark is None else (mark.stream, mark.sequence + 1)

    @property
    def error(self) -> str:
        return "" if self._reader is not None else f"there is no ring {self.path} yet"

    def poll(self, wait: float) -> Sequence[Block | Damaged]:
        until = time.monotonic() + wait
        while True:
            found = self._new()
            if found or time.monotonic() >= until:
                return found
            time.sleep(LOOK)

    def fetch(self, stream: int, numbers: Sequence[int]) -> Sequence[Block]:
        if self._reader is None:
            return ()
        return [b for n in numbers if (b := self._reader.read(stream, n)) is not None]

    def release(self, held: Sequence[Block]) -> None:
        return

    def close(self) -> None:
        if self._reader is not None:
            self._reader.close()

    def _new(self) -> list[Block]:
        reader = self._open()
        told = None if reader is None else reader.next()
        if reader is None or told is None or told[1] == 0:
            return []
        stream, following = told
        oldest = max(following - reader.slots, 0)
        if self._at is None or self._at[0] != stream or self._at[1] > following:
            self._at = (stream, oldest)
        found = [b for n in range(max(self._at[1], oldest), following) if (b := reader.read(stream, n)) is not None]
        self._at = (stream, following)
        return found

    def _open(self) -> RingReader | None:
        """The ring, once there is one; another that took its place."""
        if self._reader is not None and self._reader.replaced():
            self._reader.close()
            self._reader = None
        if self._reader is None:
            try:
                self._reader = RingReader(self.path)
            except TwinError:
                if self.path.is_file() and self.path.stat().st_size:
                    raise
        return self._reader
