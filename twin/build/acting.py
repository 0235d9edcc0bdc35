"""A drive with heat and films at places: what a hidden cause does to the loads of a machine with places."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from twin.build.places import PREFIX
from twin.rom.drive import Drive
from twin.rom.load_model import LoadModel


@dataclass(frozen=True)
class Acting:
    """What acts besides the description, per step (n,) of a drive."""

    power: Mapping[str, np.ndarray] = field(default_factory=dict)  # place -> W
    film: Mapping[str, np.ndarray] = field(default_factory=dict)  # place -> W/(m^2 K), on top of the film it has
    medium: Mapping[str, np.ndarray] = field(default_factory=dict)  # place -> degC of that film's medium


def with_acting(drive: Drive, load: LoadModel, acting: Acting) -> Drive:
    """The drive of a description for the load model of its machine with places (`with_places`, maybe `pruned`).

    load: with places; its sources, films and environments begin with those of the description.
    Raises KeyError for a place that the load model lacks, or a film without its medium.
    """
    n = drive.n_steps
    sources = [s.name[len(PREFIX) :] for s in load.sources if s.name.startswith(PREFIX)]
    films = [f.name[len(PREFIX) :] for f in load.films if f.name.startswith(PREFIX)]
    lacking = [p for p in acting.power if p not in sources] + [p for p in acting.film if p not in films]
    if lacking:
        raise KeyError(lacking[0])
    zero = np.zeros(n)
    power = [np.broadcast_to(acting.power.get(p, zero), (n,)) for p in sources]
    theta = [np.broadcast_to(acting.film.get(p, zero), (n,)) for p in films]
    nominal = {e.name: np.full(n, e.temperature) for e in load.environments if e.name.startswith(PREFIX)}
    air = [np.broadcast_to(acting.medium[p], (n,)) if p in acting.film else nominal[PREFIX + p] for p in films]
    cut = len(load.films) - len(films)
    none = np.zeros((n, 0))
    return replace(
        drive,
        power=np.column_stack([drive.power, *power]) if power else drive.power,
        theta=np.hstack([drive.theta[:, :cut], np.column_stack(theta) if theta else none, drive.theta[:, cut:]]),
        environment=np.column_stack([drive.environment, *air]) if air else drive.environment,
    )
