"""Many parameter samples through one run at once: what the uncertainty of parameters makes of the prediction.

Samples share loads, contacts and everything else that does not depend on them, so that the matrices of all are one
product per step. The window model is the one of a fit, or one made for a coarser tolerance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp
import numpy as np

from twin.calibrate.fit.problem import FitRun, Form, Problem, outputs_of

CHUNK = 64  # samples stepped together: their matrices stay in the cache of a core


@dataclass(frozen=True)
class Batch:
    """m samples of one run."""

    temperature: np.ndarray  # (m, b, s) degC, means of bins
    tcp: np.ndarray  # (m, k, 3) m


def batch(problem: Problem, run: FitRun, samples: np.ndarray, advance: Callable[[int], None] = lambda _: None) -> Batch:
    """The outputs of a run at samples (m, n) in prior standard deviations; `advance` is called with each count done.

    Samples outside the parameters' bounds are stepped as they are: the caller draws them.
    """
    m = len(samples)
    pieces = [samples[i : i + CHUNK] for i in range(0, m, CHUNK)]

    def step(piece: np.ndarray) -> np.ndarray:
        padded = np.concatenate([piece, np.repeat(piece[-1:], CHUNK - len(piece), axis=0)])  # one compiled function
        flat = np.asarray(problem.call(_many, run, jnp.asarray(padded * problem.scale)))
        advance(len(piece))
        return flat[: len(piece)]

    # one after the other: two such programs at once can wait for each other's share of XLA's threads for ever
    flat = np.concatenate([step(piece) for piece in pieces])
    T, w = zip(*(problem.split(run, one) for one in flat), strict=True)
    return Batch(np.array(T), np.array(w))


@partial(jax.jit, static_argnums=0)
def _many(form: Form, *arguments: Any) -> jax.Array:
    shared, u = arguments[:-1], arguments[-1]
    one: Callable[[jax.Array], jax.Array] = partial(outputs_of, form, *shared)
    return jax.vmap(one)(u)
