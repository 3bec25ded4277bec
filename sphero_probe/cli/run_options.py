"""The options that choose recorded runs, which several commands share."""

import click

from sphero_probe.cli.age_type import Date
from sphero_probe.cli.complete.lazily import offer
from sphero_probe.cli.gathered import Function, gather
from sphero_probe.cli.values import RunChoice


def run_filter_options(function: Function) -> Function:
    """Give a command the options that choose runs; it gets ``chosen``, a ``RunChoice``."""
    return gather(
        function,
        "chosen",
        RunChoice,
        click.option(
            "--robot",
            "chosen_robot",
            default="",
            metavar="NAME",
            help="Runs of this robot; BP-* for several.",
        ),
        click.option(
            "--model",
            "chosen_model",
            default="",
            metavar="MODEL",
            help="Runs of this model, like bolt-plus.",
            shell_complete=offer("robots"),
        ),
        click.option(
            "--firmware",
            "chosen_firmware",
            default="",
            metavar="VERSION",
            help="Runs where a node had this version; 4.* for several.",
        ),
        click.option(
            "--outcome",
            "chosen_outcome",
            type=click.Choice(("complete", "incomplete")),
            help="Runs that were finished, or were not.",
        ),
        click.option(
            "--tag", "chosen_tags", multiple=True, metavar="WORD", help="Runs with this tag; may be repeated."
        ),
        click.option(
            "--since",
            "chosen_since",
            type=Date(),
            metavar="DATE",
            help="Runs that started on 2026-11-26 (UTC) or later; 7d for the last seven days.",
        ),
        click.option(
            "--until", "chosen_until", type=Date(), metavar="DATE", help="Runs that started before this."
        ),
    )
