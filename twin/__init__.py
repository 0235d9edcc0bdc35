"""twin: compile a machine-tool description into a reduced thermo-elastic model and run it beside the machine.

    import twin

    machine = twin.load("models/five_axis")
    model = twin.build(machine)
    result = model.run("models/five_axis/runs/experiment_a")
    result.plot.workspace(at="4 h")

The import costs nothing: each name is loaded when it is first asked for (PEP 562). docs/python.md has recipes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

__version__ = "0.1.0"

if TYPE_CHECKING:  # for editors and type checkers; what runs is below
    from twin.build.pipeline import BuildOptions as BuildOptions
    from twin.errors import TwinError as TwinError
    from twin.export.options import ExportOptions as ExportOptions
    from twin.face.build import build as build
    from twin.face.calibrate import CalibrateOptions as CalibrateOptions
    from twin.face.calibrate import calibrate as calibrate
    from twin.face.check import check as check
    from twin.face.diagnose import DiagnoseOptions as DiagnoseOptions
    from twin.face.diagnose import diagnose as diagnose
    from twin.face.export import export as export
    from twin.face.hide import HideOptions as HideOptions
    from twin.face.hide import hide as hide
    from twin.face.machine import Machine as Machine
    from twin.face.machine import load as load
    from twin.face.model import Model as Model
    from twin.face.model import read as read
    from twin.face.result import Result as Result
    from twin.face.rtest import RTestOptions as RTestOptions
    from twin.face.rtest import rtest as rtest
    from twin.face.run import run as run
    from twin.face.score import ScoreOptions as ScoreOptions
    from twin.face.score import score as score
    from twin.face.simulate import SimulateOptions as SimulateOptions
    from twin.face.simulate import simulate as simulate
    from twin.face.update import UpdateOptions as UpdateOptions
    from twin.face.update import update as update
    from twin.logs.run import Run as Run
else:
    _FUNCTIONS = {  # name -> where it is
        "load": "face.machine",
        "check": "face.check",
        "read": "face.model",
        "simulate": "face.simulate",
        "score": "face.score",
        "update": "face.update",
        "rtest": "face.rtest",
        "hide": "face.hide",
    }
    # verbs that are packages: they can be called, twin.verbs
    _PACKAGES = ("build", "run", "calibrate", "diagnose", "export")
    _TYPES = {
        "Machine": "face.machine",
        "Model": "face.model",
        "Result": "face.result",
        "Run": "logs.run",
        "TwinError": "errors",
        "BuildOptions": "build.pipeline",
        "SimulateOptions": "face.simulate",
        "ScoreOptions": "face.score",
        "CalibrateOptions": "face.calibrate",
        "UpdateOptions": "face.update",
        "RTestOptions": "face.rtest",
        "DiagnoseOptions": "face.diagnose",
        "HideOptions": "face.hide",
        "ExportOptions": "export.options",
    }

    def __getattr__(name: str) -> object:
        where = _FUNCTIONS.get(name) or _TYPES.get(name)
        if where is None and name not in _PACKAGES:
            raise AttributeError(f"module 'twin' has no attribute '{name}'")
        from importlib import import_module

        from twin.threads import one_thread_each

        one_thread_each()
        if where is None:
            return import_module(f"twin.{name}")
        return getattr(import_module(f"twin.{where}"), name)

    def __dir__() -> list[str]:
        return sorted({*globals(), *_FUNCTIONS, *_PACKAGES, *_TYPES})
