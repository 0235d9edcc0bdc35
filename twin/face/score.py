"""A model on measured runs, beside what needs no model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.errors import LogError, TwinError
from twin.face.inputs import Quantity, listed, name_of, positive, run_of
from twin.progress import Progress, reporter

if TYPE_CHECKING:
    from twin.calibrate.score.score import Score as Figures
    from twin.calibrate.score.score import Settings
    from twin.face.model import Model
    from twin.logs.run import Run

Runs = Sequence["Run | str | Path"]
MOST_CHANNELS = 8  # that the terminal tells at most, of those that leap or are refuted


@dataclass(frozen=True)
class ScoreOptions:
    """How a score is taken."""

    dt: Quantity = "60 s"
    substeps: int | None = None
    restart: bool = False  # segments are tests of their own, each from its own initial state
    hold_interval: Quantity = "0 s"  # between the measurements that "hold last" may use; 0: all of them
    tcp_noise: Quantity = "1 um"  # standard deviation where tcp.csv has none
    noise: Quantity = "0.1 K"
    inputs: Sequence[str] = ()  # columns that learned baselines read; empty: all temperatures

    def settings(self) -> Settings:
        """In SI."""
        from twin.calibrate.score.score import Settings

        return Settings(
            dt=positive("dt", self.dt, "s"),
            substeps=self.substeps,
            restart=self.restart,
            tcp_sigma=positive("tcp_noise", self.tcp_noise, "m"),
            temperature_sigma=positive("noise", self.noise, "K"),
            interval=positive("hold_interval", self.hold_interval, "s", zero=True),
            inputs=tuple(self.inputs),
        )


@dataclass(frozen=True)
class Score:
    """Figures per sensor and axis, per segment and pooled (docs/scores.md)."""

    facts: Mapping[str, Any] = field(repr=False)  # what score.json holds; K and m
    figures: Figures = field(repr=False)
    source: str = ""  # of the model

    @property
    def temperature_rms(self) -> float:
        """K: measured minus computed rise, all sensors of the scored runs pooled."""
        return self._pooled("temperature", "all")

    @property
    def tcp_rms(self) -> float:
        """m: length of measured minus computed TCP error, all scored runs pooled."""
        return self._pooled("tcp", "vector")

    def _pooled(self, kind: str, output: str) -> float:
        wanted = ("scored", "", "", "K" if kind == "temperature" else "m", output, "model")
        for row in self.facts["figures"]:
            if (row["part"], row["run"], row["segment"], row["unit"], row["output"], row["method"]) == wanted:
                return float(row["rms"])
        raise TwinError(f"no {kind} was measured in the scored runs", self.source, "score a run that holds some")

    def __str__(self) -> str:
        from twin.calibrate.channels.table import channel_lines
        from twin.calibrate.score.text import score_text

        refuted = [f"refuted: {what}" for what in self.facts.get("refuted", [])]
        channels = channel_lines(self.facts.get("channels", []), MOST_CHANNELS, marked_only=True)
        return "\n".join([score_text(self.figures, self.source), *refuted, *channels])


def score(
    model: Model | str | Path,
    runs: Runs | Run | str | Path,
    sealed: Runs = (),
    train: Runs = (),
    options: ScoreOptions | None = None,
    output: str | Path | None = None,
    progress: Progress | bool | None = None,
) -> Score:
    """Replay measured runs on a model and compare, beside baselines that need no model.

    sealed: runs kept back from every fit, scored by themselves. train: runs that baselines learn from, not scored.
    output: folder for score.json, score.csv and, where matplotlib is installed, channels.png: every channel, measured
    and computed. Temperature channels that all others refute are told in `refuted` and `channels`; they are scored all
    the same.
    Raises LogError for runs without anything measured, TwinError for a run that is given twice.

    >>> import twin
    >>> model = twin.build("tests/machines/spindle", options=twin.BuildOptions(held_out=4))
    >>> truth = twin.simulate("tests/machines/spindle", "tests/machines/spindle/runs/warm_up", "out/truth")
    >>> score = twin.score(model, "out/truth")
    >>> score.temperature_rms < 0.01  # K: nothing is reduced away here; the simulation took steps half as long
    True
    """
    from twin.run.replay import replay  # noqa: F401  isort: skip  first: it prepares JAX before NumPy is loaded

    from twin import __version__
    from twin.atomic import check_folder
    from twin.calibrate.channels.explained import judge_beside
    from twin.calibrate.channels.judge import set_aside, words
    from twin.calibrate.channels.table import as_set_aside, channel_rows, with_findings
    from twin.calibrate.score.files import score_json, write_score
    from twin.calibrate.score.score import run_name
    from twin.calibrate.score.score import score as figures
    from twin.face.model import read
    from twin.run.results import refuse_run_folder

    settings = (options or ScoreOptions()).settings()
    if output is not None:
        check_folder(Path(output))
        refuse_run_folder(Path(output))
    loaded = read(model)
    scored, kept, learnt = _groups({"RUN": listed(runs), "--sealed": sealed, "--train": train}, settings.restart)
    found = figures(loaded.artefact, scored, kept, learnt, settings, reporter(progress))
    facts = {
        "machine": loaded.name,
        "artefact": loaded.source,
        "model_sha256": loaded.artefact.digest,
        "twin": __version__,
    }
    told = score_json(found, settings, facts)
    measured = [*scored, *kept]
    judgement = judge_beside(loaded.artefact, [run for _, run in measured])
    names = [run_name(name) for name, _ in measured]
    told["refuted"] = [words(f, names) for f in judgement.findings]
    sound = set_aside([run for _, run in measured], judgement.findings)
    marked = as_set_aside(with_findings(found.traces, judgement, names), names, sound)
    told["channels"] = channel_rows(marked, judgement, names)
    if output is not None:
        write_score(Path(output), told, found)
        with suppress(ModuleNotFoundError):  # the edge draws nothing
            from twin.pictures.channels import write_channels

            write_channels(Path(output) / "channels.png", marked)
    return Score(told, found, loaded.source or loaded.name)


def _groups(parts: Mapping[str, Runs], restart: bool) -> list[list[tuple[str, Run]]]:
    """(name, run) of each group. Raises TwinError for a run in two groups and for one without anything measured."""
    seen: dict[object, str] = {}
    groups: list[list[tuple[str, Run]]] = []
    for label, given in parts.items():
        group = []
        for one in given:
            name = name_of(one)
            place = Path(one).resolve() if isinstance(one, str | Path) else id(one)
            if place in seen:
                what = f"is given twice, as {seen[place]} and as {label}"
                raise TwinError(what, name, "score a run once, and never on what the baselines learned from")
            seen[place] = label
            run = run_of(one)
            if run.temperatures is None and run.tcp is None:
                raise LogError("nothing measured", name, "a run to score needs temperatures.csv or tcp.csv")
            if restart and not run.segments:
                remedy = 'write segments = [{ name = "heating", start = "0 h", end = "4 h" }] in its run.toml'
                raise LogError("no segments to restart at", name, f"{remedy}, or leave out --restart")
            group.append((name, run))
        groups.append(group)
    return groups
