"""twin: compile a machine-tool description into a reduced thermo-elastic model and run it beside the machine."""

__version__ = "0.1.0"
