"""What a simulation gets wrong, named: evidence, causes, extension, gain."""

from twin.verbs import callable_package

callable_package(__name__)
