"""Every number that decides something in a search, once: what it is, its unit, and where it comes from.

`python -m benchmarks sensitivity` halves and doubles each on stored trials, and tells which verdicts change.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from enum import Enum
from typing import Any


class Origin(Enum):
    """Where a number comes from."""

    DERIVED = "follows from what it says"
    JUDGED = "a judgement before any result"
    FIVE_AXIS = "chosen on campaigns of effects hidden in five_axis (docs/campaign.md)"
    LUMPED = "chosen on one case of a lumped machine, held against drawn networks"
    SOLVER = "how an iteration goes on and ends"


def _rule(value: float, unit: str, origin: Origin, meaning: str) -> Any:
    return field(default=value, metadata={"unit": unit, "origin": origin, "meaning": meaning})


@dataclass(frozen=True)
class SearchPolicy:
    """What a search decides by; units "" are shares, factors or counts."""

    causes: int = _rule(3, "", Origin.JUDGED, "at most that are named together")
    tries: int = _rule(3, "", Origin.FIVE_AXIS, "rounds of candidates that the exact model refuses")
    ahead: int = _rule(
        12, "", Origin.JUDGED, "of those that pass, how many get further windows before the best is chosen"
    )
    named: float = _rule(
        0.7, "", Origin.FIVE_AXIS, "share of its own threshold that a name needs where another one passes"
    )
    stands: float = _rule(
        0.5,
        "",
        Origin.FIVE_AXIS,
        "share of its threshold that a cause must explain beside the others, and of the least size",
    )
    switches: int = _rule(
        4,
        "",
        Origin.FIVE_AXIS,
        "windows in which a cause switches at one place: what does so more often has a history that no name tells",
    )
    few: int = _rule(2, "", Origin.FIVE_AXIS, "windows that a cause may have and still leave heat where it is")
    left: float = _rule(
        0.5, "", Origin.FIVE_AXIS, "of the threshold of heat of any history: what windows may leave of it"
    )
    misfit: float = _rule(
        0.003,
        "",
        Origin.DERIVED,
        "of what a cause explains: a response that is wrong by a twentieth leaves 0.05^2 of it",
    )
    later: float = _rule(
        2.5,
        "",
        Origin.FIVE_AXIS,
        "times its threshold that a cause beside another one needs: the first one's misfits look like causes",
    )
    covers: float = _rule(0.9, "", Origin.FIVE_AXIS, "of the evidence for heat of any history that a name must explain")
    rival: float = _rule(10.0, "likelihood-ratio units", Origin.JUDGED, "within which another explanation is a rival")
    entrants: int = _rule(5, "", Origin.FIVE_AXIS, "candidates of a kind that are refitted")
    behind: float = _rule(
        0.15, "", Origin.FIVE_AXIS, "of the leader: who scores less cannot overtake it by being refitted"
    )
    saturates: float = _rule(
        0.4,
        "",
        Origin.FIVE_AXIS,
        "likewise of capacities and of coolants' films: the larger they are, the worse is linearity",
    )
    edge: float = _rule(4.0, "likelihood-ratio units", Origin.FIVE_AXIS, "that an edge gains where nothing is hidden")
    amplitude: float = _rule(
        8.0, "likelihood-ratio units", Origin.FIVE_AXIS, "that a second amplitude costs: of a coolant beside plain heat"
    )
    gone: float = _rule(
        -0.7, "relative change", Origin.JUDGED, "of a conductance, linearly: it is nearly gone, and always refitted"
    )
    bends: float = _rule(
        2.5, "prior standard deviations", Origin.FIVE_AXIS, "that only something hidden moves a parameter by"
    )
    growth: float = _rule(12.0, "likelihood-ratio units", Origin.JUDGED, "that another window must bring")
    growth_share: float = _rule(
        0.05,
        "",
        Origin.FIVE_AXIS,
        "and the least share of what the others explain: a strong cause has misfits that windows imitate",
    )
    most_windows: int = _rule(8, "", Origin.JUDGED, "of one cause")
    closely: int = _rule(
        3,
        "",
        Origin.FIVE_AXIS,
        "factors that are looked at again where their parameters are; likewise of a signal, fitted exactly",
    )
    signals: int = _rule(2, "", Origin.FIVE_AXIS, "of which any factor is fitted exactly")
    pulled: float = _rule(
        2.5,
        "standard deviations",
        Origin.FIVE_AXIS,
        "by which data without its tolerance must tell a number from the declared one",
    )
    beyond: float = _rule(
        3.0,
        "prior standard deviations",
        Origin.FIVE_AXIS,
        "that a number out of its tolerance keeps beside any other explanation",
    )
    outside: float = _rule(1.0, "prior standard deviations", Origin.DERIVED, "the declared tolerance itself")
    nearly: float = _rule(
        0.75, "of a bound", Origin.LUMPED, "from which the surrogate of the settled calibration says little of a size"
    )
    sure: float = _rule(
        1.96,
        "standard deviations",
        Origin.DERIVED,
        "of its own that a number without its tolerance is off: its 95 % interval",
    )
    alike: float = _rule(
        0.9,
        "cosine",
        Origin.FIVE_AXIS,
        "of what a signal's factor and a declared number do, from which the one may be the other",
    )
    same: float = _rule(0.998, "cosine", Origin.FIVE_AXIS, "likewise of what is read nowhere else")
    distant: float = _rule(
        1.0,
        "logarithm of a factor",
        Origin.FIVE_AXIS,
        "of a source, beyond which derivatives of the described machine say little",
    )
    form: float = _rule(0.1, "logarithm of a factor", Origin.FIVE_AXIS, "of a source, that model discrepancy takes")
    faint: float = _rule(
        0.2,
        "",
        Origin.FIVE_AXIS,
        "of what explains most: a declared number that scores less leaves that, whatever it is freed to",
    )
    roughly: float = _rule(
        2.0,
        "",
        Origin.FIVE_AXIS,
        "times the linear estimate of what the data determine: a number that may come out so sure is freed",
    )
    far: int = _rule(
        2, "", Origin.FIVE_AXIS, "numbers that are freed, each alone: the farthest may be another one's doing"
    )
    others: int = _rule(12, "", Origin.JUDGED, "other explanations that are looked at")
    hotter: float = _rule(
        1.4,
        "",
        Origin.FIVE_AXIS,
        "times the described rise of a channel: parameters within their tolerances stay below",
    )
    apart: float = _rule(
        10.0,
        "likelihood-ratio units",
        Origin.JUDGED,
        "that LR (1 - cos^2) must exceed for two causes to be distinguished",
    )
    close: float = _rule(
        6.0,
        "likelihood-ratio units",
        Origin.JUDGED,
        "within which a rival of another family, or another part, makes a verdict ambiguous",
    )
    power: float = _rule(1.645, "standard deviations", Origin.DERIVED, "one-sided 95 %, of a detection limit")
    remainder: float = _rule(
        0.35,
        "",
        Origin.JUDGED,
        "of the evidence for unknown heat before all names: the share that may be left beside them",
    )
    block: float = _rule(7200.0, "s", Origin.JUDGED, "of the bootstrap")
    noticed: float = _rule(
        0.5, "", Origin.JUDGED, "of a channel's noise, by which causes must move it to count as affected"
    )
    thermocouple: float = _rule(0.1, "K", Origin.JUDGED, "noise of a sensor that no fitted run has")
    passes: int = _rule(3, "", Origin.SOLVER, "of an exact refit without edges")
    window_passes: int = _rule(8, "", Origin.SOLVER, "of one with edges")
    read_passes: int = _rule(6, "", Origin.SOLVER, "of what is read and not in proportion to its size")
    held: int = _rule(
        2, "", Origin.SOLVER, "in which a coolant's heat and edges are found for its usual film, before all are free"
    )
    trial: int = _rule(4, "", Origin.SOLVER, "by which coolants are compared before the best of them are refitted")
    enough: float = _rule(0.02, "of a size", Origin.SOLVER, "that a pass moves it by when it has arrived")
    less: float = _rule(1.0, "likelihood-ratio units", Origin.SOLVER, "a pass that changes less is the last")
    less_share: float = _rule(1e-3, "", Origin.SOLVER, "of a statistic, likewise")
    near: float = _rule(1.0, "prior standard deviations", Origin.SOLVER, "longest step of parameters in an exact refit")
    lowest_change: float = _rule(
        -0.97,
        "relative change",
        Origin.SOLVER,
        "from -0.98 on the integration holds a conductance, and no derivative is left",
    )
    highest_change: float = _rule(20.0, "relative change", Origin.SOLVER, "beyond the range of every conductance")
    aside: float = _rule(
        0.1, "of a size", Origin.SOLVER, "by which what is read and curved is moved for its derivative"
    )
    first_order_passes: int = _rule(4, "", Origin.SOLVER, "of a fit beside a change that is known")
    exact_passes: int = _rule(3, "", Origin.SOLVER, "likewise of the model with a corrected signal")
    wide: float = _rule(
        1e3, "standard deviations", Origin.SOLVER, "that an accepted amplitude may take: as good as free"
    )
    refits: int = _rule(10, "", Origin.SOLVER, "passes of all causes together")
    longest: float = _rule(0.7, "logarithm of a factor", Origin.SOLVER, "longest step")
    still: float = _rule(
        0.1, "standard deviations", Origin.SOLVER, "of amplitudes: a pass that changes less is the last"
    )
    refit_less: float = _rule(0.5, "likelihood-ratio units", Origin.SOLVER, "a pass that changes less is the last")
    anew: int = _rule(5, "", Origin.SOLVER, "passes in which derivatives beyond all bounds are made anew")
    rises: int = _rule(2, "", Origin.SOLVER, "passes in a row that make it worse, after which it runs away")


POLICY = SearchPolicy()


def rules() -> tuple[tuple[str, float, str, Origin, str], ...]:
    """(name, value, unit, origin, meaning) of every number."""
    return tuple(
        (f.name, getattr(POLICY, f.name), f.metadata["unit"], f.metadata["origin"], f.metadata["meaning"])
        for f in fields(SearchPolicy)
    )
