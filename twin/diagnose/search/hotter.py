"""Model discrepancy of channels that get far hotter than described: it grows with the response.

A detector knows the model discrepancy of the described machine. A motor that gives off twice its heat is wrong by twice
as much wherever that heat goes, and would be called by the name of whatever looks most like the rest.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.diagnose.model.study import Study
from twin.diagnose.search.detector import Detector


def hotter(detector: Detector, x: np.ndarray) -> Detector:
    """The detector at parameters x (n,) in prior standard deviations; itself where no channel is much `hotter`."""
    surrogate = detector.fitter.surrogate
    least = detector.policy.rise_temperature, detector.policy.rise_displacement
    times = _rise(detector.study, surrogate.at(x)[0], least) / _rise(detector.study, surrogate.y0, least)
    times = np.where(times > detector.policy.hotter, times, 1.0)
    if np.all(times == 1.0):
        return detector
    others = times[:, None] * detector.fitter.others
    return replace(detector, fitter=replace(detector.fitter, others=others), columns=detector.columns.beside(others))


def _rise(study: Study, flat: np.ndarray, least: tuple[float, float]) -> np.ndarray:
    """(m,) for every number the rms rise of its channel in its run, at least `least`."""
    parts = []
    for _, *own in study.split(flat):
        for values, floor in zip(own, least, strict=True):
            if len(values):
                rms = np.sqrt(((values - values[0]) ** 2).mean(axis=0))
                parts.append(np.broadcast_to(np.maximum(rms, floor), values.shape).ravel())
    return np.concatenate(parts) if parts else np.zeros(0)
