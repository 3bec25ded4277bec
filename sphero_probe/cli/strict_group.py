"""Groups that say where an option belongs; one is a command of its own where no subcommand is named."""

import click
from click.core import ParameterSource

from sphero_probe.cli.strict import StrictCommand


class StrictGroup(StrictCommand, click.Group):
    """A group with options, checked as those of ``StrictCommand``; a subcommand excludes them."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, then the subcommands."""
        StrictCommand.format_options(self, ctx, formatter)
        self.format_commands(ctx, formatter)


class OptionlessGroup(click.Group):
    """A group that says of an option of its subcommands that it stands after them."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the command line.

        Raises:
            UsageError: an option of a subcommand stands before it, or is not known at all.
        """
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            option = error.option_name
            owners = [
                name
                for name, command in self.commands.items()
                if any(option in param.opts for param in command.params)
            ]
            if not owners:
                raise
            example = f"{ctx.command_path} {owners[0]} {option}"
            raise click.UsageError(f"write {option} after the subcommand: {example}", ctx) from error


def refuse_options(ctx: click.Context) -> None:
    """Refuse options that stand before a subcommand: they belong to the group's own command.

    Raises:
        UsageError: there is one.
    """
    for param in ctx.command.params:
        if param.name and ctx.get_parameter_source(param.name) is ParameterSource.COMMANDLINE:
            option = max(param.opts, key=len)
            raise click.UsageError(f"write {option} after {ctx.invoked_subcommand}", ctx)
