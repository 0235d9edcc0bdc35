"""What a fitted size may be wrong by because the form of the model is."""

from __future__ import annotations

from twin.diagnose.evidence.batch import Hypothesis

# What a size may be wrong by because the model's form is: relative standard deviations, by family or kind. Coefficients
# of films are known least, and temperatures that nobody measured.
OWN = {
    "film": 0.12,
    "group": 0.12,
    "gain": 0.1,
    "group_film": 0.12,
    "coolant": 0.3,  # at least of WET: in campaigns films between 30 and 120 W/(m^2 K) came out some 20 too small
    "scale": 0.12,
    "moved": 0.2,
    "capacity": 0.1,
    "slip": 0.12,
    "sun": 0.12,
    "zone": 0.1,
}
OWN_OTHERS = 0.05


def size_discrepancy(h: Hypothesis) -> float:
    """Relative standard deviation of the size of a hypothesis."""
    return OWN.get(h.family, OWN.get(h.batch.kind, OWN_OTHERS))
