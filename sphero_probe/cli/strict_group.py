"""A group that is a command of its own where no subcommand is named."""

import click
from click.core import ParameterSource

from sphero_probe.cli.strict import StrictCommand


class StrictGroup(StrictCommand, click.Group):
    """A group with options, checked as those of ``StrictCommand``; a subcommand excludes them."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, then the subcommands."""
        StrictCommand.format_options(self, ctx, formatter)
        self.format_commands(ctx, formatter)


def refuse_options(ctx: click.Context) -> None:
    """Refuse options that stand before a subcommand: they belong to the group's own command.

    Raises:
        UsageError: there is one.
    """
    for param in ctx.command.params:
        if param.name and ctx.get_parameter_source(param.name) is ParameterSource.COMMANDLINE:
            option = max(param.opts, key=len)
            raise click.UsageError(f"write {option} after {ctx.invoked_subcommand}", ctx)
