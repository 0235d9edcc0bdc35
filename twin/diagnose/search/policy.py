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
    PARTS = "chosen on seeds 0 and 1 of the shipped ball-screw axis, held against 3 and 5 (docs/campaign.md)"
    SOLVER = "how an iteration goes on and ends"


DERIVED, JUDGED, FIVE_AXIS, LUMPED, PARTS, SOLVER = Origin


def _rule(value: float, origin: Origin, meaning: str, unit: str = "") -> Any:
    return field(default=value, metadata={"unit": unit, "origin": origin, "meaning": meaning})


@dataclass(frozen=True)
class SearchPolicy:
    """What a search decides by; without a unit: shares, factors, counts."""

    # a model that is wrong in its form, and members that it lacks
    chance: float = _rule(3.0, DERIVED, "by which what is left is more than chance", "standard deviations")
    weighings: int = _rule(2, SOLVER, "of channels that leap by more than their noise, each from what a search leaves")
    excess: float = _rule(0.5, PARTS, "of what is left beyond noise, discrepancy, slow errors: a cause must explain it")
    dispersed: float = _rule(3.0, LUMPED, "of what is left per measured number, from which it becomes slow errors")
    slow_rows: int = _rule(12, JUDGED, "of a channel in a run, from which a slow error is learned")
    slow_longest: float = _rule(0.98, JUDGED, "of neighbours: four hours of 5 min, of runs of a day", "correlation")
    slow_least: float = _rule(1.0, DERIVED, "of a mode of slow errors: less than noise is none", "variances of noise")
    halves: float = _rule(0.5, JUDGED, "of what the recalibrated model leaves of displacements: members leave less")
    predicts: float = _rule(0.7, JUDGED, "of what the model leaves of stretches left out: members leave less")
    rows: int = _rule(24, JUDGED, "of displacements, four hours of one in ten minutes, that missing members need")
    worst: int = _rule(3, JUDGED, "sensors that are told where a model is too poor")
    # what is named
    causes: int = _rule(3, JUDGED, "at most that are named together")
    tries: int = _rule(3, FIVE_AXIS, "rounds of candidates that the exact model refuses")
    ahead: int = _rule(12, JUDGED, "of those that pass, the worthiest in their best windows, that are compared")
    named: float = _rule(0.7, FIVE_AXIS, "share of its own threshold that a name needs where another one passes")
    stands: float = _rule(0.5, FIVE_AXIS, "of its threshold, and of the least size, that a cause keeps beside others")
    switches: int = _rule(
        4, FIVE_AXIS, "windows of a cause at one place: of more the history is one that no name tells"
    )
    entering: int = _rule(2, JUDGED, "places at most of heat of any history, which more of explain anything")
    few: int = _rule(2, FIVE_AXIS, "windows that a cause may have and still leave heat where it is")
    left: float = _rule(0.5, FIVE_AXIS, "of the threshold of heat of any history: what windows may leave of it")
    misfit: float = _rule(0.003, DERIVED, "of what a cause explains: a response wrong by a twentieth leaves 0.05^2")
    later: float = _rule(1.5, FIVE_AXIS, "of what any cause needs: one beside another needs that more, for misfits")
    covers: float = _rule(0.9, FIVE_AXIS, "of the evidence for heat of any history that a name must explain")
    rival: float = _rule(10.0, JUDGED, "within which another explanation is a rival", "likelihood-ratio units")
    entrants: int = _rule(5, FIVE_AXIS, "candidates of a kind that are refitted")
    behind: float = _rule(0.15, FIVE_AXIS, "of the leader: who scores less cannot overtake it by being refitted")
    saturates: float = _rule(0.4, FIVE_AXIS, "of the leader, for capacities and coolants: linearity is worse there")
    switched: float = _rule(0.6, LUMPED, "the same of windows: what is felt at once shows every error of the response")
    closest: int = _rule(3, JUDGED, "strong causes near the leader that are fitted closer")
    edge: float = _rule(4.0, FIVE_AXIS, "that an edge gains where nothing is hidden", "likelihood-ratio units")
    amplitude: float = _rule(8.0, FIVE_AXIS, "that a second amplitude costs", "likelihood-ratio units")
    gone: float = _rule(-0.7, JUDGED, "of a conductance that is nearly gone, and always refitted", "relative change")
    bends: float = _rule(
        2.5, FIVE_AXIS, "by which only something hidden moves a parameter", "prior standard deviations"
    )
    growth: float = _rule(12.0, JUDGED, "that another window must bring", "likelihood-ratio units")
    growth_share: float = _rule(0.05, FIVE_AXIS, "and of what the others explain: windows imitate a cause's misfits")
    edge_moves: int = _rule(16, SOLVER, "quarters of blocks by which edges of windows move before a refit")
    most_windows: int = _rule(8, JUDGED, "of one cause")
    # declared numbers and signals
    closely: int = _rule(3, FIVE_AXIS, "factors that are fitted where their parameters are; of a signal exactly")
    signals: int = _rule(2, FIVE_AXIS, "of which any factor is fitted exactly")
    pulled: float = _rule(2.5, FIVE_AXIS, "that data tell a number from the declared one by", "standard deviations")
    beyond: float = _rule(3.0, FIVE_AXIS, "that a loose number keeps beside any other", "prior standard deviations")
    outside: float = _rule(1.0, DERIVED, "the declared tolerance itself", "prior standard deviations")
    alone: float = _rule(
        0.5, FIVE_AXIS, "of what the other fit alone is sure of, that the settled calibration must not exclude"
    )
    nearly: float = _rule(0.75, LUMPED, "of a bound, from which the surrogate of the settled calibration says little")
    sure: float = _rule(1.96, DERIVED, "of its own, of a 95 % interval", "standard deviations")
    same: float = _rule(0.998, FIVE_AXIS, "of a signal's factor and a declared number that do the same", "cosine")
    distant: float = _rule(1.0, FIVE_AXIS, "of a source, beyond which derivatives say little", "logarithm of a factor")
    form: float = _rule(0.1, FIVE_AXIS, "of a source, that model discrepancy takes", "logarithm of a factor")
    faint: float = _rule(0.2, FIVE_AXIS, "of what explains most: a declared number that scores less leaves that")
    roughly: float = _rule(2.0, FIVE_AXIS, "times what data determine to first order: as sure may a freed number be")
    far: int = _rule(2, FIVE_AXIS, "numbers that are freed, each alone: the farthest may be another one's doing")
    others: int = _rule(12, JUDGED, "other explanations that are looked at")
    hotter: float = _rule(1.4, FIVE_AXIS, "times the described rise of a channel: within tolerances it stays below")
    rise_temperature: float = _rule(1.0, JUDGED, "rms of a described rise that a ratio is taken to, at least", "K")
    rise_displacement: float = _rule(5e-6, JUDGED, "the same of the TCP", "m")
    # verdicts, limits and gains
    apart: float = _rule(
        10.0, JUDGED, "of LR (1 - cos^2) of two causes that are distinguished", "likelihood-ratio units"
    )
    close: float = _rule(6.0, JUDGED, "within which a rival makes a verdict ambiguous", "likelihood-ratio units")
    power: float = _rule(1.645, DERIVED, "one-sided 95 %, of a detection limit", "standard deviations")
    limit_sizes: int = _rule(16, SOLVER, "in equal ratios, at which a limit of what is curved is sought")
    remainder: float = _rule(0.35, JUDGED, "of the evidence for heat before all names, that may be left beside them")
    block: float = _rule(7200.0, JUDGED, "of the bootstrap", "s")
    draws: int = _rule(400, SOLVER, "of the bootstrap")
    noticed: float = _rule(0.5, JUDGED, "of a channel's noise, by which causes must move it to count as affected")
    # 55 foreign lumped sets without an effect in the sealed run alone had 1.9 at most, the two with one 15 and 19
    elsewhere: float = _rule(3.0, LUMPED, "times what is left of a channel in any other run: a sealed run has its own")
    thermocouple: float = _rule(0.1, JUDGED, "noise of a sensor that no fitted run has", "K")
    # iterations
    passes: int = _rule(3, SOLVER, "of an exact refit without edges")
    window_passes: int = _rule(16, SOLVER, "of one with edges")
    read_passes: int = _rule(6, SOLVER, "of what is read and not in proportion to its size")
    held: int = _rule(2, SOLVER, "passes that find a coolant's heat and edges for its usual film, before all are free")
    trial: int = _rule(4, SOLVER, "passes by which coolants are compared before the best of them are refitted")
    enough: float = _rule(0.02, SOLVER, "that a pass moves it by when it has arrived", "of a size")
    less: float = _rule(1.0, SOLVER, "a pass that changes less is the last", "likelihood-ratio units")
    less_share: float = _rule(1e-3, SOLVER, "of a statistic, a pass that changes less is the last")
    near: float = _rule(1.0, SOLVER, "longest step of parameters in an exact refit", "prior standard deviations")
    lowest_change: float = _rule(
        -0.97, SOLVER, "of a conductance: at -0.98 the integration holds it", "relative change"
    )
    highest_change: float = _rule(20.0, SOLVER, "beyond the range of every conductance", "relative change")
    aside: float = _rule(0.1, SOLVER, "by which what is read and curved is moved for its derivative", "of a size")
    first_order_passes: int = _rule(4, SOLVER, "of a fit beside a change that is known")
    exact_passes: int = _rule(3, SOLVER, "of a fit of the model with a corrected signal")
    wide: float = _rule(1e3, SOLVER, "that an accepted amplitude may take: as good as free", "standard deviations")
    refits: int = _rule(10, SOLVER, "passes of all causes together")
    longest: float = _rule(0.7, SOLVER, "longest step", "logarithm of a factor")
    still: float = _rule(0.1, SOLVER, "of amplitudes: a pass that changes less is the last", "standard deviations")
    refit_less: float = _rule(0.5, SOLVER, "a pass that changes less is the last", "likelihood-ratio units")
    anew: float = _rule(
        0.5, SOLVER, "by which parameters move before derivatives that no surrogate knows are made anew",
        "prior standard deviations",
    )  # fmt: skip
    rises: int = _rule(2, SOLVER, "passes in a row that make it worse, after which it runs away")
    # what the shape of a cause leaves open
    edge_prior: float = _rule(1800.0, DERIVED, "standard deviation of an edge: half an hour's block", "s")
    edge_step: float = _rule(1800.0, SOLVER, "longest step of an edge", "s")
    exponent: float = _rule(0.12, JUDGED, "standard deviation of a signal's exponent about the one of the catalogue")
    longer: float = _rule(1800.0, JUDGED, "standard deviation of the length of a bell that was fitted", "s")


POLICY = SearchPolicy()


def rules() -> tuple[tuple[str, float, str, Origin, str], ...]:
    """(name, value, unit, origin, meaning) of every number."""
    return tuple(
        (f.name, getattr(POLICY, f.name), f.metadata["unit"], f.metadata["origin"], f.metadata["meaning"])
        for f in fields(SearchPolicy)
    )
