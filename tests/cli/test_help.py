"""How help is arranged: commands in groups, options in sections, exit codes at the end."""

import re

import pytest

from sphero_probe.cli.group import COMMANDS, EXIT_CODES, SECTIONS
from sphero_probe.errors import SpheroProbeError
from tests.support.cli import Cli


def test_every_command_is_in_one_group() -> None:
    named = [name for names in SECTIONS.values() for name in names]
    assert sorted(named) == sorted(COMMANDS)


def test_the_group_lists_the_groups_and_the_exit_codes(cli: Cli) -> None:
    shown = cli("--help").out
    places = [shown.index(f"\n{title}:\n") for title in SECTIONS]
    assert places == sorted(places)
    assert shown.index("Exit codes:") > places[-1]


def test_the_exit_codes_are_those_of_the_exceptions() -> None:
    def codes(kind: type[SpheroProbeError]) -> set[int]:
        return {kind.exit_code}.union(*map(codes, kind.__subclasses__()))

    written = {int(number) for number in re.findall(r"(\d+) [a-z]", EXIT_CODES)}
    assert codes(SpheroProbeError) <= written


@pytest.mark.parametrize(
    ("command", "sections"),
    [
        pytest.param(
            "sweep",
            ["Options", "What to ask", "Consent", "Robot and link", "Journal", "Checks", "Output"],
            id="sweep",
        ),
        pytest.param(
            "send",
            [
                "Options",
                "What to ask",
                "Consent",
                "Flags of the packet",
                "Robot and link",
                "Journal",
                "Output",
            ],
            id="send",
        ),
        pytest.param("explain", ["Options", "Output"], id="explain"),
    ],
)
def test_options_are_in_sections(cli: Cli, command: str, sections: list[str]) -> None:
    assert re.findall(r"^([A-Z][a-z ]+):$", cli(command, "--help").out, re.MULTILINE) == sections


def test_every_form_of_an_address_and_every_class_is_explained(cli: Cli) -> None:
    shown = " ".join(cli("sweep", "--help").out.split())
    for form in (
        "BP-12",
        "serial:/dev/ttyS0",
        "rfcomm:/dev/rfcomm0",
        "fake:bolt-plus",
        "SPHERO_PROBE_DEVICE",
    ):
        assert form in shown
    for risk in ("write:", "motion:", "persist:", "brick:"):
        assert risk in shown
