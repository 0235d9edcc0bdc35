"""The compiler's code leaves memory, and comes back when it is called."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import twin.run.jax_setup  # noqa: F401  isort: skip

import jax
import jax.numpy as jnp

from twin.live.give_back import give_back


def code_in_memory() -> int:
    """kB of JAX's library that are code."""
    resident, counts = 0, False
    for line in Path("/proc/self/smaps").read_text(encoding="utf-8").splitlines():
        words = line.split()
        if "-" in words[0] and not words[0].endswith(":"):
            counts = words[1] == "r-xp" and "libjax" in words[-1]
        elif counts and words[0] == "Rss:":
            resident += int(words[1])
    return resident


@pytest.mark.skipif(sys.platform != "linux", reason="/proc is of Linux")
def test_code_of_the_compiler_goes_and_comes_back():
    step = jax.jit(lambda a: a @ a + 1.0)
    expected = step(jnp.eye(3))
    before = code_in_memory()
    assert before > 10_000
    give_back()
    assert code_in_memory() < before / 4
    assert (step(jnp.eye(3)) == expected).all()
    assert jax.jit(lambda a: jnp.linalg.solve(a, a))(2.0 * jnp.eye(3))[0, 0] == 1.0
