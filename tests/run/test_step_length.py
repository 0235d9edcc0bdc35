"""A step lies within the log, and results fit the memory: asked before anything is evaluated."""

from __future__ import annotations

import pytest
import synthetic
import synthetic_run

from twin.cli.main import run

MODEL = synthetic.machine(2)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs")
    artefact = synthetic_run.artefact(folder / "a.h5", MODEL)
    return str(artefact), str(synthetic_run.run_folder(folder / "run", MODEL, hours=0.5))


@pytest.mark.parametrize(
    ("dt", "what"),
    [
        ("1e9 s", "a step of 1e+09 s is longer than the log of 1806 s"),
        ("31 min", "a step of 1860 s is longer than the log of 1806 s"),
        ("1 us", "1.81e+09 steps, some "),
        ("1e-12 s", "GB of results and"),
    ],
)
def test_a_step_that_no_run_can_have(inputs, tmp_path, capsys, dt, what):
    assert run(["run", *inputs, "-o", str(tmp_path / "out"), "--dt", dt]) == 2
    told = capsys.readouterr().err
    assert what in told
    assert "remedy: give a step within the log" in told
    assert not (tmp_path / "out").exists()


def test_a_step_as_long_as_the_log_is_flagged(inputs, tmp_path, capsys):
    assert run(["run", *inputs, "-o", str(tmp_path / "out"), "--dt", "30 min"]) == 0
    assert "step longer than the certified 60 s" in capsys.readouterr().out
