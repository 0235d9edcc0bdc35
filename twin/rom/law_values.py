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


@partial(jax.jit, static_argnames="wiring")
def _evaluate(wiring: tuple, samples: jax.Array, parameters: tuple[dict[str, jax.Array], ...]) -> jax.Array:
    columns = []
    for (law, arguments), values in zip(wiring, parameters, strict=True):
        result = LAWS[law].function(**{name: samples[column] for name, column in arguments}, **values)
        columns.append(jnp.broadcast_to(result, samples.shape[1:]))
    return jnp.stack(columns, axis=1)


def law_values(uses: Sequence[LawUse], signals: Mapping[str, np.ndarray], n_samples: int) -> np.ndarray:
    """Values (n_samples, len(uses)) of laws [W or W/(m^2 K)] at the samples of `signals` (n_samples,) each [SI].

    Raises DescriptionError for an unknown law or a missing parameter.
    """
    if not uses:
        return np.zeros((n_samples, 0))
    names = sorted({name for use in uses for name in use.signals.values()})
    wiring = tuple((use.law, tuple((a, names.index(s)) for a, s in sorted(use.signals.items()))) for use in uses)
    parameters = tuple(parameters_of(use) for use in uses)
    blocks = -(-n_samples // _BLOCK)
    table = np.zeros((len(names), blocks * _BLOCK))
    for row, name in enumerate(names):
        table[row, :n_samples] = signals[name]
        table[row, n_samples:] = signals[name][-1]
    results = [_evaluate(wiring, table[:, b * _BLOCK : (b + 1) * _BLOCK], parameters) for b in range(blocks)]
    return np.concatenate([np.asarray(r) for r in results])[:n_samples]
