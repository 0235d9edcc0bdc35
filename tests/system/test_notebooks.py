"""Notebooks and their text form have the same cells; `make notebooks` executes them."""

from pathlib import Path

import jupytext
import nbformat
import pytest

FOLDER = Path(__file__).parents[2] / "notebooks"
TEXTS = sorted(p for p in FOLDER.glob("*.py") if p.name != "execute.py")


@pytest.mark.parametrize("text", TEXTS, ids=lambda p: p.stem)
def test_the_notebook_was_made_from_its_text(text):
    script = jupytext.read(text)
    notebook = nbformat.read(text.with_suffix(".ipynb"), as_version=4)
    assert [(c.cell_type, c.source) for c in notebook.cells] == [(c.cell_type, c.source) for c in script.cells]
    executed = [c.execution_count for c in notebook.cells if c.cell_type == "code"]
    assert executed == list(range(1, len(executed) + 1)), "run `make notebooks`"
    assert any("assert " in c.source for c in script.cells if c.cell_type == "code")


def test_there_are_notebooks():
    assert TEXTS
