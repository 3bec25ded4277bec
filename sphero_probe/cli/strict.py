"""A command class that reports contradicting options, where click would use the last one."""

from typing import Any, Final

import click

SECTIONS: Final = {
    "asking": "What to ask",
    "asking_allow": "Consent",
    "asking_confirm": "Consent",
    "asking_dry_run": "Consent",
    "flags": "Flags of the packet",
    "connecting": "Robot and link",
    "journal": "Journal",
    "baseline": "Checks",
    "fail": "Checks",
    "chosen": "Which runs",
    "output": "Output",
}
"""The name of an option's parameter, or its beginning -> the section of help that shows the option."""
_OWN: Final = "Options"


def _section(option: click.Parameter) -> str:
    name = option.name or ""
    return SECTIONS.get(name) or SECTIONS.get(name.partition("_")[0], _OWN)


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

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options in sections: the command's own first, then those that it shares."""
        sections: dict[str, list[tuple[str, str]]] = {_OWN: []}
        for option in self.get_params(ctx):
            if record := option.get_help_record(ctx):
                sections.setdefault(_section(option), []).append(record)
        order = list(dict.fromkeys((_OWN, *SECTIONS.values())))
        for title in sorted(sections, key=order.index):
            if sections[title]:
                with formatter.section(title):
                    formatter.write_dl(sections[title])

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the command line.

        Raises:
            UsageError: an option is given twice, or two that exclude each other.
        """
        if not ctx.resilient_parsing:  # that is set while a shell completes an unfinished line
            _, words, given = self.make_parser(ctx).parse_args(list(args))  # in order, repetitions included
            options = [option for option in given if isinstance(option, click.Option)]
            _check(ctx, options)
            belongs_to = self._words_belong_to
            asked = any(option.is_eager or belongs_to in option.opts for option in options)
            if words and belongs_to and not asked:
                raise click.UsageError(f"'{words[0]}': write {belongs_to} {words[0]}", ctx)
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
            spelling = _spelling(option)
            many = "; for several robots: sphero-probe fleet --help" if spelling == "--device" else ""
            raise click.UsageError(f"{spelling} is given twice{many}", ctx)
        if other:
            raise click.UsageError(f"{_spelling(other)} and {_spelling(option)} exclude each other", ctx)
        earlier[option.name] = option


def _spelling(option: click.Option) -> str:
    return max(option.opts, key=len)
