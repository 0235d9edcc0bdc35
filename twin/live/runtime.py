"""The process beside the machine: blocks in, journal, machine, correction out, health; whatever happens in between."""

from __future__ import annotations

import fcntl
import os
import resource
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.errors import TwinError
from twin.live.block import Block
from twin.live.checkpoint import Checkpoint, read_checkpoint, remove_checkpoint, write_checkpoint
from twin.live.clock import Clock
from twin.live.engine import EngineFailure
from twin.live.health import FORMAT, HealthFiles, Latency
from twin.live.intake import Intake
from twin.live.journal import Journal, Position
from twin.live.offsets import offsets
from twin.live.publisher import Publisher
from twin.live.source import Mark, Source
from twin.logs.resolver import Damaged, Resolver

if TYPE_CHECKING:
    from twin.live.learning import Learning

WINDOW = 4  # blocks: so many later ones must have come before a missing one is given up, 40 s of blocks of 10 s
LOOK = 0.5  # s that a source may wait for something to arrive


@dataclass(frozen=True)
class Keeping:
    """How much is kept, and how often."""

    folder: Path
    journal: int = 256 << 20  # bytes
    checkpoint: float = 600.0  # s of the machine's time between checkpoints
    pause: float = 2.0  # s of real time at least between them: a state is a megabyte
    health: float = 2.0  # s of real time between health records


class Runtime:
    """Everything wired up; one thread takes blocks in, another one (`beat`) steps the outputs when none come."""

    def __init__(self, intake: Intake, source: Source, publisher: Publisher, clock: Clock, keeping: Keeping):
        """Raises TwinError where the folder is in use or cannot be written."""
        self.intake, self.source, self.publisher = intake, source, publisher
        self.clock, self.keeping = clock, keeping
        self._lock = _locked(keeping.folder)
        self.journal = Journal(keeping.folder / "journal", keeping.journal)
        self.files = HealthFiles(keeping.folder)
        self.resolver: Resolver[Block] = Resolver(window=WINDOW, keep_overlaps=True, first=None)
        self.latency = Latency()
        self.failure = ""
        self.taken_again = 0  # blocks of the journal
        self.fetched = 0  # blocks that were missing and the source still had
        self._mark: Mark | None = None
        self._asked: set[int] = set()
        self._saved = (0.0, 0.0)  # of the machine's time and of real time: the last checkpoint
        self._told = (0.0, "")  # real time of the last health record, mode of the last event
        self._step_time = 0.0
        self._step = 0  # the last one that was written
        self._began = time.time()
        self._going = False  # past the journal

    # ---- beginning ----

    def begin(self, fresh: bool) -> None:
        """Go on from checkpoint and journal, or start afresh. Raises TwinError where they are of another machine."""
        path = self.keeping.folder / "checkpoint.bin"
        if fresh:
            remove_checkpoint(path)
            self.journal.clear()
            if self.intake.learning is not None:
                self.intake.learning.clear()
        else:
            self._restore(read_checkpoint(path), path)
        if self.intake.learning is not None:
            self.intake.learning.begun()
        self.source.resume(self._mark)
        if self.intake.base is not None and not self.failure:
            if self.intake.engine.steps:
                self._aim()
            self.publisher.alive(self.clock.now(), 0.0, "", self.intake.timeline.spacing)
            self.publisher.tick(self.clock.now())

    def _restore(self, found: Checkpoint | None, path: Path) -> None:
        at = Position(0, 0)
        digest = self.intake.engine.facts.digest
        if found is not None:
            if found.told["artefact"] != digest:
                remedy = "give the artefact it was made with, another --state, or --fresh to forget it"
                raise TwinError("the state is of another artefact", str(path), remedy)
            self.intake.engine.restore(found.engine)
            self.intake.restore(found.told["intake"])
            at = Position(*found.told["journal"])
            self._mark = Mark(*found.told["mark"]) if found.told["mark"] else None
        self.journal.needed = at.segment
        for block in self.journal.since(at):
            self.taken_again += 1
            self._mark = Mark(block.stream, block.sequence)
            self._feed(block)
        if self._mark is not None and self.source.numbered:
            self.resolver.go_on(self._mark.stream, self._mark.sequence + 1)

    # ---- one block after the other ----

    def once(self, wait: float = LOOK) -> bool:
        """Take in what has arrived within `wait` seconds; whether anything did."""
        arrivals = self.source.poll(wait)
        arrived = time.perf_counter()
        blocks = [b for a in arrivals for b in self._in_order(a)] + self._caught_up()
        for block in blocks:
            self._take(block)
            self.latency.take(time.perf_counter() - arrived)
            self._settle()
        self.source.release(self.resolver.held())
        self._tell()
        return bool(arrivals)

    def _in_order(self, arrival: Block | Damaged) -> list[Block]:
        if self.source.numbered or isinstance(arrival, Damaged):
            return self.resolver.push(arrival)
        return [arrival]

    def _caught_up(self) -> list[Block]:
        """Missing blocks, asked for once each where later ones have come."""
        missing = [n for n in self.resolver.missing() if n not in self._asked]
        if not missing or self._mark is None:
            return []
        self._asked = set(self.resolver.missing())
        found = self.source.fetch(self.resolver.stream, missing)
        self.fetched += len(found)
        return [b for block in found for b in self.resolver.push(block)]

    def _take(self, block: Block) -> None:
        self._going = True
        self.journal.append(block)
        self._mark = Mark(block.stream, block.sequence)
        self._feed(block)
        intake, line = self.intake, self.intake.timeline
        self.clock.records(line.end)
        now = self.clock.now()
        age, whose = (0.0, "") if intake.base is None else intake.gate.oldest(line.last)
        waiting = intake.gate.waiting()
        why = f"no value of {', '.join(waiting)} yet" if waiting else f"no good value of {whose}" if whose else ""
        self.publisher.alive(
            now, age if age > line.spacing else 0.0, why, block.records * block.interval, block.sequence
        )
        self.publisher.tick(now)

    def _settle(self) -> None:
        """What outputs need not wait for."""
        self.journal.sync_when_due()
        self._checkpoint()

    def _feed(self, block: Block) -> None:
        if self.failure:
            return
        began = time.perf_counter()
        try:
            self.intake.take(block, self._stepped)
        except EngineFailure as e:
            self.failure = f"the model has failed: {e.problems[0].what}"
            self.publisher.fail(self.failure)
        self._step_time = time.perf_counter() - began

    def _stepped(self) -> None:
        if self.intake.learning is not None and self._going:
            self._learn(self.intake.learning)
        self._aim()
        if not self.source.speed and self._going:  # at once: time passes with the records
            self.publisher.tick(self.clock.now())

    def _aim(self) -> None:
        engine, form = self.intake.engine, self.publisher.form
        self.publisher.aim(offsets(engine.facts, self.intake.errors(), form))

    def _learn(self, learning: Learning) -> None:
        """Measured TCP errors that have come."""
        line, base = self.intake.timeline, self.intake.base or 0.0
        active = self.publisher.outlets[0].now if self.publisher.outlets else None
        for told in learning.listen(line.shift - line.origin - base, active, self.publisher.form):
            self.files.event({"time": time.time(), "measured": told})

    # ---- what is kept and told ----

    def _checkpoint(self, now: bool = False) -> None:
        machine, real = self.intake.timeline.end, time.monotonic()
        due = machine - self._saved[0] >= self.keeping.checkpoint and real - self._saved[1] >= self.keeping.pause
        if not (due or now) or self.failure:
            return
        self.journal.sync()  # a checkpoint never knows of blocks that the journal lacks
        at = self.journal.position
        mark = self._mark
        told = {
            "artefact": self.intake.engine.facts.digest,
            "journal": [at.segment, at.offset],
            "mark": None if mark is None else [mark.stream, mark.sequence],
            "intake": self.intake.stored(),
        }
        if self.intake.base is not None:
            write_checkpoint(self.keeping.folder / "checkpoint.bin", Checkpoint(told, self.intake.engine.saved()))
            self.journal.needed = at.segment
        self._saved = (machine, real)

    def _tell(self) -> None:
        publisher, real = self.publisher, time.monotonic()
        changed = publisher.mode != self._told[1]
        if changed:
            self.files.event({"time": time.time(), "mode": publisher.mode, "words": publisher.words})
        if changed or real - self._told[0] >= self.keeping.health:
            self._write_step()
            self.files.write(self.health())
            self._told = (real, publisher.mode)

    def _write_step(self) -> None:
        """The last step of the model, where it is another than the one written; docs/live.md describes it."""
        engine, line, gate = self.intake.engine, self.intake.timeline, self.intake.gate
        if self.intake.base is None or engine.steps in (0, self._step) or self.failure:
            return
        self._step = engine.steps
        since = self.intake.base + engine.steps * engine.facts.step
        self.files.step({
            "artefact": engine.facts.digest,
            "step": engine.steps,
            "time": line.origin - line.shift + since,
            "temperatures_degC": engine.sensors(),
            "displacements_m": engine.displacements(),
            "positions_m": [gate.good[k] for k in engine.facts.axis_channels],
            "states": engine.states(),
            "flags": engine.flags(),
        })  # fmt: skip

    def health(self) -> dict[str, Any]:
        """The record as docs/live.md describes it."""
        intake, publisher, engine = self.intake, self.publisher, self.intake.engine
        line, gate, facts = intake.timeline, intake.gate, intake.engine.facts
        alarms = intake.drift.alarms()
        running = intake.base is not None and engine.steps > 0
        flags = engine.flags() if running else []
        return {
            "format": FORMAT,
            "written": time.time(),
            "started": self._began,
            "machine": facts.machine,
            "artefact": facts.digest,
            "certificate": facts.certificate,
            "mode": publisher.mode,
            "words": publisher.words,
            "trust": _trust(publisher, flags, alarms, [f"{k} {v}" for k, v in intake.wrong.items()],
                            self.source.error),
            "input": {
                "source_error": self.source.error,
                "age_s": publisher.age(self.clock.now()),
                "records": intake.records,
                "records_before_start": intake.dropped,
                "blocks": dict(vars(self.resolver.counts)),
                "taken_again_from_journal": self.taken_again,
                "fetched_from_source": self.fetched,
                "gaps": line.gaps,
                "held_s": line.held,
                "clock_leaps": line.leaps,
                "records_left_out": line.left_out,
                "values_refused": dict(gate.refused),
                "columns_not_used": dict(intake.wrong),
            },
            "model": {
                "steps": engine.steps,
                "time_s": line.end,
                "balance_error": engine.balance() if running else None,
                "worst_balance_error": intake.worst_balance,
                "flags": flags,
                "temperatures_degC": dict(zip(facts.sensors, engine.sensors(), strict=True)) if running else {},
            },
            "correction": {
                "form": publisher.form,
                "largest_m": {
                    a.name: max(abs(v) for v in values)
                    for a, values in zip(facts.axes, publisher.outlets[0].now, strict=True)
                } if publisher.outlets else {},
                "limit_m": publisher.limits.most,
                "slew_m_per_s": publisher.limits.slew,
                "cut_to_limit": publisher.limited,
                "outputs": [
                    {"name": o.sink.name, "failures": o.failures, "error": o.error} for o in publisher.outlets
                ],
            },
            "sensors": {
                name: {"residual_K": None if r.last != r.last else r.last, "mean_K": r.mean, "first_hours_K": r.first}
                for name, r in intake.drift.of.items()
            },
            "drift": alarms,
            "learnt": None if intake.learning is None else intake.learning.health(),
            "latency": self.latency.told() | {"last_step_s": self._step_time},
            "memory_bytes": _resident(),
            "journal_bytes": self.journal.bytes,
        }  # fmt: skip

    # ---- running ----

    def run(self, stop: Callable[[], bool]) -> None:
        """Until `stop` says so, or the source has ended and the outputs stand still."""
        beat = threading.Event()
        threads, whole = [], False
        if self.source.speed:
            threads.append(threading.Thread(target=self._beat, args=(beat,), daemon=True))
            threads[0].start()
        try:
            while not stop() and not self.source.ended:
                self.once()
            for block in self.resolver.finish():
                self._take(block)
                self._settle()
            whole = True
        finally:
            beat.set()
            for t in threads:
                t.join()
            self.close(whole)

    def _beat(self, stop: threading.Event) -> None:
        while not stop.wait(self.publisher.limits.period / max(self.source.speed, 1.0)):
            self.publisher.tick(self.clock.now())

    def close(self, whole: bool = True) -> None:
        """Keep everything; outputs stay where they are, and their readers see that they grow old.

        whole: the last block of the journal went into the model; else the next start takes it again.
        """
        if whole:
            self._checkpoint(now=True)
            self.source.release(self.resolver.held())
        self._write_step()
        self.files.write(self.health())
        self.journal.close()
        self.source.close()
        self.publisher.close()
        os.close(self._lock)


def _resident() -> int:
    """Memory of this process [bytes]; its peak where the system does not tell more."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def _trust(publisher: Publisher, flags: list[str], alarms: list[str], wrong: list[str], error: str) -> str:
    """Can I trust it? In one line."""
    if publisher.mode != "following":
        return f"no: {publisher.words}" + (f"; {error}" if error else "")
    doubts = [*alarms, *(f"outside what was certified: {f}" for f in flags), *(f"column {w}" for w in wrong)]
    if publisher.limited:
        doubts.append("the correction is cut to its absolute limit")
    return f"with care: {'; '.join(doubts)}" if doubts else "yes: inputs are fresh and inside what was certified"


def _locked(folder: Path) -> int:
    """A lock that the kernel takes away with the process; what a killed one left half-written is removed."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = os.open(folder / "lock", os.O_RDWR | os.O_CREAT)
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as e:
        raise TwinError("another process is at work here", str(folder), "stop it, or name another --state") from e
    except OSError as e:
        raise TwinError(f"cannot write: {e.strerror or e}", str(folder), "choose another --state") from e
    for part in folder.glob(".*.part"):
        part.unlink(missing_ok=True)
    return lock
