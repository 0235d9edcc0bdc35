"""Flags of laws that follow the machine's temperatures: known only after a run."""

from __future__ import annotations

import numpy as np

from twin.physics.laws import LAWS
from twin.rom.drive import Drive, outside_flag
from twin.rom.following import TEMPERATURES, WIDEST, FilmPlan, difference_place, temperature_place
from twin.rom.load_model import LoadModel

AT_REST = 0.05  # K: closer to its surroundings a surface exchanges no heat that counts, whatever its coefficient


def following_flags(
    load: LoadModel, drive: Drive, plan: FilmPlan, theta: np.ndarray, surface: np.ndarray, winding: np.ndarray
) -> dict[str, np.ndarray]:
    """Name -> (n_steps,) bool: coefficients outside the certified range, and laws outside their validity.

    theta (n_steps, n_theta) W/(m^2 K), surface (n_steps, n_films) and winding (n_steps, len(drive.losses.index)) degC
    as stepped.
    """
    flags: dict[str, np.ndarray] = {}
    air = plan.air(drive.environment, drive.mean_position)
    radiant = drive.environment[:, plan.radiant]
    exchanges = (np.abs(surface - air) > AT_REST) | ((plan.emissivity > 0) & (np.abs(surface - radiant) > AT_REST))
    for k, film in enumerate(load.films):
        margin = 1e-9 * film.high
        flags[f"films.{film.name} below {film.low:g} W/(m^2*K)"] = exchanges[:, k] & (theta[:, k] < film.low - margin)
        flags[f"films.{film.name} above {film.high:g} W/(m^2*K)"] = theta[:, k] > film.high + margin
    step = np.arange(drive.n_steps)
    for column, k in enumerate(drive.films.index):
        if validity := LAWS[load.films[k].use.law].validity:
            place = difference_place(np, surface[:, k] - air[:, k])
            outside = _outside(drive.films.outside[step, column], place) & (np.abs(surface[:, k] - air[:, k]) > AT_REST)
            outside |= np.abs(surface[:, k] - air[:, k]) > WIDEST  # the table's end is held
            flags[outside_flag("films", load.films[k].name, validity.text)] = outside
    for column, k in enumerate(drive.losses.index):
        if validity := LAWS[load.sources[k].use.law].validity:
            outside = _outside(drive.losses.outside[step, column], temperature_place(np, winding[:, column]))
            outside |= (winding[:, column] < TEMPERATURES[0]) | (winding[:, column] > TEMPERATURES[-1])
            flags[outside_flag("sources", load.sources[k].name, validity.text)] = outside
    return flags


def _outside(table: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Whether a table (n, m) of "outside" holds at either point beside each place (n,): rather a flag too many."""
    step = np.arange(len(place))
    return table[step, np.floor(place).astype(int)] | table[step, np.ceil(place).astype(int)]
