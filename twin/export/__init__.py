"""Artefacts in other people's tools: one file per format, one table of them (`twin.export.formats`)."""

from twin.verbs import callable_package

callable_package(__name__)
