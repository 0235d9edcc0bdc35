"""Edge: loads in, temperatures and TCP error out."""

from twin.verbs import callable_package

callable_package(__name__)
