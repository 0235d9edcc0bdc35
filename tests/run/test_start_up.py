"""The edge starts fast: `twin run` and `twin info` load nothing of the workshop."""

import subprocess
import sys

import pytest

HEAVY = ("pint", "pandas", "matplotlib", "skfem", "meshio", "pydantic", "scipy.sparse.linalg", "tomlkit", "twin.build",
         "twin.machine")  # fmt: skip


@pytest.mark.parametrize(
    ("modules", "also"),
    [
        ("twin.run.replay, twin.run.results, twin.cli.run, twin.rom.artefact", ()),
        ("twin.cli.info, twin.rom.artefact", ("jax",)),
    ],
)
def test_imports_stay_lean(modules, also):
    code = f"import sys, {modules}; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert [name for name in (*HEAVY, *also) if name in loaded] == []


@pytest.mark.long
def test_double_precision_whatever_is_imported_first():
    for first in ("twin.physics.laws", "twin.run.stepping", "twin.rom.drive"):
        code = f"import {first}, jax.numpy as jnp; print(jnp.ones(1).dtype)"
        told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
        assert told.strip() == "float64"


@pytest.mark.long
def test_one_blas_thread_and_a_cache_that_cannot_be_written(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    code = (
        "import os, twin.run.jax_setup, jax, jax.numpy as jnp\n"
        "print(os.environ['OPENBLAS_NUM_THREADS'], jax.config.jax_compilation_cache_dir, jax.jit(lambda x: x + 1)(1.0))"
    )
    environment = {"PATH": "", "HOME": str(tmp_path), "TWIN_CACHE": str(blocked / "below")}
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert told.stdout.split() == ["1", "None", "2.0"]
    environment["TWIN_CACHE"] = str(tmp_path / "cache")
    subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert list((tmp_path / "cache").rglob("*-cache"))
