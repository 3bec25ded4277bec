"""Printing what a dry run leaves out."""

import click


def print_dry_run_note() -> None:
    """Say on standard error what a dry run leaves out."""
    click.echo(
        "dry run: nothing is sent. A real run first wakes the robot, reads its version and measures\n"
        "whether it checks lengths; where it does not, what is unknown is withheld.",
        err=True,
    )
