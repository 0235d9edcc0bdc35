"""Offline: full model, reduction, certificate."""

from twin.verbs import callable_package

callable_package(__name__)
