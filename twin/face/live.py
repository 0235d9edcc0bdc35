"""The process beside the machine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from twin.errors import TwinError
from twin.face.inputs import Quantity, positive, quantity

if TYPE_CHECKING:
    from twin.live.channels import Channels
    from twin.live.engine import Engine
    from twin.live.facts import Facts
    from twin.live.learning import Learning
    from twin.live.runtime import Runtime
    from twin.live.sinks import Sink


@dataclass(frozen=True)
class LiveOptions:
    """How the process works; every limit is of the offset of an axis, anywhere in the workspace."""

    engine: Literal["c", "jax"] = "c"
    form: Literal["grid", "polynomial"] = "grid"
    initial: Quantity | None = None  # temperature of the whole machine at a fresh start; None: of the air around it
    speed: float = 1.0  # of a replay, times real time; 0: as fast as it goes
    limit: Quantity = "200 um"
    slew: Quantity = "0.2 um/s"  # ten times the fastest drift in experiment A of the five-axis machine
    period: Quantity = "1 s"  # between steps of the outputs
    freeze: Quantity = "60 s"  # age of inputs at which the correction freezes
    neutral: Quantity = "600 s"  # age at which it returns to zero offsets
    journal: int = 256  # MB
    channels: str | Path | None = None  # file with nodes of OPC UA and limits of values
    events: str | Path | None = None  # file or folder of measured TCP errors, which correct the model
    learn: Literal["gain", "state"] | None = None  # filter of `twin update`; None: gain where there are events
    fresh: bool = False  # forget what is in the state folder


def live(
    artefact: str | Path,
    source: str,
    out: Sequence[str],
    state: str | Path,
    options: LiveOptions | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> Runtime:
    """Run beside a machine until the source ends or `stop()` is true: blocks of loads in, axis offsets out.

    source: "csv:FILE", "replay:RUN", "ring:FILE", "mqtt:HOST:PORT/TOPIC" or "opcua:URL". out: "file:FILE", "ring:FILE",
    "mqtt:HOST:PORT/TOPIC" or "opcua:URL". state: folder for journal, checkpoint and health record, from which a process
    that was killed goes on. Returns the closed runtime, whose counts and state can be read; docs/live.md has all of it.
    Raises TwinError for a machine without a TCP, a state of another artefact or in use, and names of no source.
    """
    runtime = wired(artefact, source, out, state, options or LiveOptions())
    runtime.begin((options or LiveOptions()).fresh)
    runtime.run(stop)
    return runtime


def wired(artefact: str | Path, source: str, out: Sequence[str], state: str | Path, options: LiveOptions) -> Runtime:
    """The same, not begun."""
    from twin.live.channels import read_channels
    from twin.live.clock import RealClock, RecordClock
    from twin.live.gate import limits_of
    from twin.live.intake import Intake
    from twin.live.limiter import Limits
    from twin.live.offsets import neutral
    from twin.live.opened import open_engine
    from twin.live.publisher import Patience, Publisher
    from twin.live.runtime import Keeping, Runtime
    from twin.live.source import open_source

    if not 0.0 <= options.speed < 1e9:
        raise TwinError(f"speed {options.speed:g} is out of range", "--speed", "write --speed 1000, or 0")
    limits = Limits(
        positive("--limit", options.limit, "m"),
        positive("--slew", options.slew, "m/s"),
        positive("--period", options.period, "s"),
    )
    patience = Patience(positive("--freeze", options.freeze, "s"), positive("--neutral", options.neutral, "s"))
    initial = None if options.initial is None else quantity("--initial", options.initial, "degC")
    folder = Path(state)
    engine = open_engine(Path(artefact), options.engine, folder / "engine")
    facts = engine.facts
    channels = read_channels(None if options.channels is None else Path(options.channels), facts)
    incoming = open_source(source, options.speed, channels, facts)
    sinks = [open_sink(text, facts, options.form, channels) for text in out]
    publisher = Publisher(sinks, neutral(facts, options.form), options.form, limits, patience)
    clock = RealClock(incoming.speed) if incoming.speed else RecordClock()
    learning = _learning(Path(artefact), engine, folder, options)
    intake = Intake(engine, limits_of(facts, channels.limits), initial, incoming.numbered, learning)
    return Runtime(intake, incoming, publisher, clock, Keeping(folder, options.journal << 20))


def _learning(artefact: Path, engine: Engine, folder: Path, options: LiveOptions) -> Learning | None:
    """What learns from measured values; None: nothing. Raises TwinError where the filter chosen cannot."""
    if options.events is None and options.learn is None:
        return None
    if len(engine.facts.offset_per_error[0]) != 3:
        what = "three components of a TCP error do not tell which of six struts is too long"
        raise TwinError(what, "--events" if options.events else "--learn", "leave it out: the model corrects alone")
    from twin.live.learner import Filter, Learner
    from twin.live.learning import Learning

    if options.learn == "state":
        if options.engine != "jax":
            raise TwinError("the filter state steps a tangent of the model in JAX", "--learn", "add --engine jax")
        from twin.live.engine_jax import JaxEngine
        from twin.live.filter_state import StateFilter

        assert isinstance(engine, JaxEngine)
        own: Filter = StateFilter(artefact, engine)
    elif options.events is None:
        raise TwinError("the filter gain learns from measured TCP errors alone", "--learn", "name them with --events")
    else:
        from twin.live.filter_gain import GainFilter

        own = GainFilter(engine.facts.all_poses)
    events = None if options.events is None else Path(options.events)
    return Learning(engine.facts, Learner(engine.facts, own), events, folder)


def open_sink(text: str, facts: Facts, form: Literal["grid", "polynomial"], channels: Channels) -> Sink:
    """The output that `text` names: kind:place. Raises TwinError for other kinds."""
    kind, colon, place = text.partition(":")
    if colon and place and kind == "file":
        from twin.live.sinks import FileSink

        return FileSink(facts, form, Path(place))
    if colon and place and kind == "ring":
        from twin.live.sinks import RingSink

        return RingSink(facts, form, Path(place))
    if colon and place and kind == "opcua":
        from twin.live.opcua import OpcUaSink

        return OpcUaSink(facts, place, channels)
    if colon and place and kind == "mqtt":
        from twin.live.mqtt import MqttSink

        return MqttSink(facts, form, place, channels)
    kinds = "file:FILE, ring:FILE, mqtt:HOST:PORT/TOPIC or opcua:opc.tcp://HOST:PORT"
    raise TwinError(f"'{text}' names no output", "--out", f"write {kinds}")
