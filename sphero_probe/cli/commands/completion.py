"""The argument of ``completion``."""

import click

from sphero_probe.cli.strict import StrictCommand


@click.command("completion", cls=StrictCommand)
@click.argument("shell", type=click.Choice(("bash", "zsh", "fish")), metavar="bash | zsh | fish")
def command(shell: str) -> None:
    """Print a completion script for a shell: commands, options, robots, names, plans and runs.

    For bash: sphero-probe completion bash >> ~/.bashrc

    For zsh (after compinit): sphero-probe completion zsh >> ~/.zshrc

    For fish: sphero-probe completion fish >> ~/.config/fish/config.fish

    It completes the robots of the last scan and the built-in ones.

    Example: sphero-probe completion bash
    """
    from sphero_probe.cli.complete.shells import script

    click.echo(script(shell), nl=False)
