"""An option that takes several values: `--sealed A B` means both, as `--sealed A --sealed B` does.

Click gives B to the arguments of the command instead, where a sealed run would be fitted to without a word. What
follows such an option up to the next one is its own, so the arguments of the command come before it.
"""

from __future__ import annotations

from typing import Any

import click


class Several(click.Option):
    """To be used with `multiple=True`."""

    def add_to_parser(self, parser: Any, ctx: click.Context) -> None:
        super().add_to_parser(parser, ctx)
        for name in self.opts:
            option = parser._long_opt.get(name) or parser._short_opt.get(name)
            if option is not None:
                option.process = _taking_all(option.process)


def _taking_all(process: Any) -> Any:
    def taken(value: Any, state: Any) -> None:
        process(value, state)
        while state.rargs and not state.rargs[0].startswith("-"):
            process(state.rargs.pop(0), state)

    return taken
