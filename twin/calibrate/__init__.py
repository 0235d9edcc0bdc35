"""Learning from measurements: scores, baselines, parameters fitted to runs, updates on the machine."""

from twin.verbs import callable_package

callable_package(__name__)
