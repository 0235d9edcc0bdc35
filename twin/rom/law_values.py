"""Losses and film coefficients at every load sample, in one compiled call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

import twin.compiled  # noqa: F401
from twin.errors import DescriptionError
from twin.physics.laws import LAWS
from twin.rom.following import DIFFERENCES
from twin.rom.load_model import LawUse

# Samples go through in blocks of one size, so that logs of any length share one compiled function.
_BLOCK = 4096
_BLOCKS_OF_TABLES = (16, 64, 256)  # of a table over states: 10 s of a log, a minute, as many numbers as in _BLOCK


def parameters_of(use: LawUse) -> dict[str, float]:
    """The parameters of a use of a law with the law's defaults filled in.

    Raises DescriptionError for an unknown law or a missing parameter.
    """
    if use.law not in LAWS:
        raise DescriptionError(f"unknown law '{use.law}'", "load model", f"laws are: {', '.join(sorted(LAWS))}")
    law = LAWS[use.law]
    values = {name: use.parameters.get(name, argument.default) for name, argument in law.parameters.items()}
    missing = [name for name, value in values.items() if value is None]
    missing += [name for name in law.signals if name not in use.signals]
    if missing:
        raise DescriptionError(f"law '{use.law}' lacks {', '.join(missing)}", "load model", "give a value or a signal")
    return {name: float(value) for name, value in values.items() if value is not None}


def states_of(use: LawUse) -> tuple[str, ...]:
    """The arguments of a use of a law that the model fills in: its states that no signal is wired to."""
    return tuple(name for name in LAWS[use.law].states if name not in use.signals)


@partial(jax.jit, static_argnames=("wiring", "holds"))
def _evaluate(
    wiring: tuple, holds: bool, samples: jax.Array, parameters: tuple[dict[str, jax.Array], ...]
) -> jax.Array:
    """Results of laws stacked on axis 1; arguments from rows of `samples`."""
    columns = []
    for (law, arguments), values in zip(wiring, parameters, strict=True):
        given = {name: samples[column] for name, column in arguments}
        row = LAWS[law]
        if holds:
            result = row.validity.holds(**given, **values) if row.validity else True
        else:
            result = row.function(**given, **values)
        columns.append(jnp.broadcast_to(result, jnp.shape(samples[0])))
    return jnp.stack(columns, axis=1)


@partial(jax.jit, static_argnames="wiring")
def _tabulate(
    wiring: tuple, samples: jax.Array, state: dict[str, jax.Array], parameters: dict[str, jax.Array]
) -> tuple[jax.Array, jax.Array | None]:
    """A law over a grid of its states and whether it holds there, None where no range is published."""
    law, arguments = wiring
    given = {name: samples[column][:, None] for name, column in arguments}
    shape = jnp.broadcast_shapes(*(jnp.shape(s) for s in state.values()), (samples.shape[1], 1))
    row = LAWS[law]
    value = jnp.broadcast_to(row.function(**given, **state, **parameters), shape)
    if row.validity is None:
        return value, None
    return value, jnp.broadcast_to(row.validity.holds(**given, **state, **parameters), shape)


def _wiring(uses: Sequence[LawUse]) -> tuple[list[str], tuple]:
    names = sorted({name for use in uses for name in use.signals.values()})
    return names, tuple((u.law, tuple((a, names.index(s)) for a, s in sorted(u.signals.items()))) for u in uses)


def _padded(
    names: Sequence[str], signals: Mapping[str, np.ndarray], n_samples: int, block: int
) -> tuple[np.ndarray, np.ndarray]:
    """Rows of signals in whole blocks (names, k * block), and which sample each column is: the last again and again."""
    sample = np.minimum(np.arange(-(-n_samples // block) * block), n_samples - 1)
    table = np.zeros((max(len(names), 1), len(sample)))
    for row, name in enumerate(names):
        table[row] = signals[name][sample]
    return table, sample


def _over_samples(uses: Sequence[LawUse], signals: Mapping[str, np.ndarray], n_samples: int, holds: bool) -> np.ndarray:
    names, wiring = _wiring(uses)
    parameters = tuple(parameters_of(use) for use in uses)
    table, _ = _padded(names, signals, n_samples, _BLOCK)
    blocks = np.split(table, table.shape[1] // _BLOCK, axis=1)
    return np.concatenate([np.asarray(_evaluate(wiring, holds, b, parameters)) for b in blocks])[:n_samples]


def law_values(uses: Sequence[LawUse], signals: Mapping[str, np.ndarray], n_samples: int) -> np.ndarray:
    """Values (n_samples, len(uses)) of laws [W or W/(m^2 K)] at the samples of `signals` (n_samples,) each [SI].

    Raises DescriptionError for an unknown law or a missing parameter.
    """
    if not uses:
        return np.zeros((n_samples, 0))
    return _over_samples(uses, signals, n_samples, False)


def laws_hold(uses: Sequence[LawUse], signals: Mapping[str, np.ndarray], n_samples: int) -> np.ndarray:
    """Whether laws are inside their validity (n_samples, len(uses)); True where none is published."""
    if not uses:
        return np.ones((n_samples, 0), dtype=bool)
    return _over_samples(uses, signals, n_samples, True).astype(bool)


def law_table(
    use: LawUse,
    signals: Mapping[str, np.ndarray],
    n_samples: int,
    states: Mapping[str, np.ndarray],
) -> tuple[np.ndarray, np.ndarray | None]:
    """One law over a grid of its states: (n_samples, m) values, and whether it holds; None where no range is published.

    states: argument -> (n_samples, m) or (1, m) [degC].
    Raises DescriptionError for an unknown law or a missing parameter.
    """
    small, middle, large = _BLOCKS_OF_TABLES
    block = small if n_samples <= small else middle if n_samples <= large else large  # four take less than to compile
    m = max(s.shape[1] for s in states.values())
    states = {name: _widened(s) if s.shape[1] == m else s for name, s in states.items()}
    names, (wiring,) = _wiring([use])
    table, sample = _padded(names, signals, n_samples, block)
    parameters, results = parameters_of(use), []
    for first in range(0, len(sample), block):
        part = slice(first, first + block)
        here = {name: s if len(s) == 1 else s[sample[part]] for name, s in states.items()}
        results.append(_tabulate(wiring, table[:, part], here, parameters))
    value = np.concatenate([v for v, _ in results])[:n_samples, :m]
    if results[0][1] is None:
        return value, None
    return value, np.concatenate([h for _, h in results])[:n_samples, :m]


def _widened(grid: np.ndarray) -> np.ndarray:
    """A grid of states with its last column again and again up to the width of the tables of films, which share their
    compiled functions: each takes a quarter of a second."""
    return np.pad(grid, ((0, 0), (0, max(len(DIFFERENCES) - grid.shape[1], 0))), mode="edge")
