"""Losses and film coefficients at every load sample, in one compiled call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from twin.errors import DescriptionError
from twin.physics.laws import LAWS
from twin.rom.load_model import LawUse

# Samples go through in blocks of one size, so that logs of any length share one compiled function.
_BLOCK = 4096
_BLOCKS_OF_TABLES = (64, 256)  # of a table over states: a minute of a log, as many numbers as in the other blocks


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
    wiring: tuple, holds: bool, samples: jax.Array, states: tuple, parameters: tuple[dict[str, jax.Array], ...]
) -> jax.Array:
    """Results of laws stacked on axis 1; arguments from rows of `samples`, or from `states` of the same use."""
    columns = []
    for (law, arguments), state, values in zip(wiring, states, parameters, strict=True):
        given = {name: samples[column] for name, column in arguments}
        shape = jnp.shape(samples[0])
        if state:
            given = {name: value[:, None] for name, value in given.items()}
            shape = jnp.broadcast_shapes(*(jnp.shape(s) for s in state.values()), (shape[0], 1))
        row = LAWS[law]
        if holds:
            result = row.validity.holds(**given, **state, **values) if row.validity else True
        else:
            result = row.function(**given, **state, **values)
        columns.append(jnp.broadcast_to(result, shape))
    return jnp.stack(columns, axis=1)


def _wiring(uses: Sequence[LawUse]) -> tuple[list[str], tuple]:
    names = sorted({name for use in uses for name in use.signals.values()})
    return names, tuple((u.law, tuple((a, names.index(s)) for a, s in sorted(u.signals.items()))) for u in uses)


def _over_samples(
    uses: Sequence[LawUse],
    signals: Mapping[str, np.ndarray],
    n_samples: int,
    states: Sequence[Mapping[str, np.ndarray]],
    holds: bool,
    block: int,
) -> list[np.ndarray]:
    """Blocks of results; states of each use: (n_samples, m) or (1, m) arrays by argument."""
    names, wiring = _wiring(uses)
    parameters = tuple(parameters_of(use) for use in uses)
    blocks = -(-n_samples // block)
    padded = np.minimum(np.arange(blocks * block), n_samples - 1)
    table = np.zeros((max(len(names), 1), blocks * block))
    for row, name in enumerate(names):
        table[row] = signals[name][padded]
    results = []
    for b in range(blocks):
        part = slice(b * block, (b + 1) * block)
        here = tuple({k: s if len(s) == 1 else s[padded[part]] for k, s in state.items()} for state in states)
        results.append(np.asarray(_evaluate(wiring, holds, table[:, part], here, parameters)))
    results[-1] = results[-1][: n_samples - (blocks - 1) * block]
    return results


def law_values(uses: Sequence[LawUse], signals: Mapping[str, np.ndarray], n_samples: int) -> np.ndarray:
    """Values (n_samples, len(uses)) of laws [W or W/(m^2 K)] at the samples of `signals` (n_samples,) each [SI].

    Raises DescriptionError for an unknown law or a missing parameter.
    """
    if not uses:
        return np.zeros((n_samples, 0))
    return np.concatenate(_over_samples(uses, signals, n_samples, [{}] * len(uses), False, _BLOCK))


def laws_hold(uses: Sequence[LawUse], signals: Mapping[str, np.ndarray], n_samples: int) -> np.ndarray:
    """Whether laws are inside their validity (n_samples, len(uses)); True where none is published."""
    if not uses:
        return np.ones((n_samples, 0), dtype=bool)
    blocks = _over_samples(uses, signals, n_samples, [{}] * len(uses), True, _BLOCK)
    return np.concatenate(blocks).astype(bool)


def law_table(
    use: LawUse,
    signals: Mapping[str, np.ndarray],
    n_samples: int,
    states: Mapping[str, np.ndarray],
    holds: bool = False,
) -> np.ndarray:
    """One law over a grid of its states: (n_samples, m) values, or whether it holds.

    states: argument -> (n_samples, m) or (1, m) [degC].
    Raises DescriptionError for an unknown law or a missing parameter.
    """
    block = next((b for b in _BLOCKS_OF_TABLES if n_samples <= b), _BLOCKS_OF_TABLES[-1])
    blocks = _over_samples([use], signals, n_samples, [states], holds, block)
    result = np.concatenate(blocks)[:, 0]
    return result.astype(bool) if holds else result
