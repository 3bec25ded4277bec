"""A command class that reports contradicting options, where click would use the last one."""

from typing import Any

import click


class StrictCommand(click.Command):
    """A command that accepts each option once, except those that are lists.

    Options for the same parameter (``--json`` and ``--format``, ``--v1`` and ``--v2``) exclude each other.
    """

    def __init__(self, *args: Any, words_belong_to: str = "", **settings: Any) -> None:
        """Take what ``click.Command`` takes.

        Args:
            *args: likewise.
            words_belong_to: the option that a word without an option was probably meant for.
            **settings: likewise.
        """
        super().__init__(*args, **settings)
        self._words_belong_to = words_belong_to

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the command line.

        Raises:
            UsageError: an option is given twice, or two that exclude each other.
        """
        if not ctx.resilient_parsing:  # that is set while a shell completes an unfinished line
            _, words, given = self.make_parser(ctx).parse_args(list(args))  # in order, repetitions included
            options = [option for option in given if isinstance(option, click.Option)]
            _check(ctx, options)
            if words and self._words_belong_to and not any(option.is_eager for option in options):
                raise click.UsageError(f"'{words[0]}': write {self._words_belong_to} {words[0]}", ctx)
        return super().parse_args(ctx, args)


def _check(ctx: click.Context, given: list[click.Option]) -> None:
    if any(option.is_eager for option in given):  # --help answers whatever else is given
        return
    earlier: dict[str | None, click.Option] = {}
    for option in given:
        if option.multiple:
            continue
        other = earlier.get(option.name)
        if other is option:
            raise click.UsageError(f"{_spelling(option)} is given twice", ctx)
        if other:
            raise click.UsageError(f"{_spelling(other)} and {_spelling(option)} exclude each other", ctx)
        earlier[option.name] = option


def _spelling(option: click.Option) -> str:
    return max(option.opts, key=len)
