"""Execute the notebooks from their text form and keep the .ipynb beside it; a failing cell fails the command.

usage: python notebooks/execute.py [notebooks/NAME.py ...]
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

import jupytext
import nbformat
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError

HERE = Path(__file__).resolve().parent


def execute(text: Path) -> None:
    """Run `text` in a fresh kernel in the repository's root and write the outputs to the paired notebook."""
    notebook = jupytext.read(text)
    notebook.metadata["kernelspec"] = {"name": "python3", "display_name": "Python 3", "language": "python"}
    root = {"metadata": {"path": HERE.parent}}
    with tempfile.TemporaryDirectory() as sockets:  # files instead of ports: nothing to open or to clash
        kernel = AsyncKernelManager(kernel_name="python3", transport="ipc", ip=f"{sockets}/kernel")
        NotebookClient(notebook, km=kernel, timeout=1200, resources=root).execute()
    for number, cell in enumerate(notebook.cells):  # nothing that differs from one execution to the next
        cell.id = f"cell-{number}"
        cell.metadata.pop("execution", None)
    nbformat.write(notebook, text.with_suffix(".ipynb"))


def main(names: list[str]) -> int:
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
    texts = [Path(n) for n in names] or sorted(p for p in HERE.glob("*.py") if p.name != Path(__file__).name)
    for text in texts:
        start = time.perf_counter()
        try:
            execute(text)
        except CellExecutionError as e:
            print(f"{text.name}: a cell failed\n{e}", file=sys.stderr)
            return 1
        seconds = time.perf_counter() - start
        print(f"{text.name}: executed in {seconds:.0f} s, written to {text.with_suffix('.ipynb').name}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
