"""The candidates for each kind of value that a shell can complete."""

from typing import TYPE_CHECKING, Final

from click import Context
from click.shell_completion import CompletionItem

from sphero_probe.catalogue import (
    DEVICE_NAMES,
    ROBOTS,
    all_rows,
    commands_of,
    robot_by_prefix,
    robot_by_word,
)
from sphero_probe.catalogue.libraries.claims import INSTALLED
from sphero_probe.catalogue.model import Kind, Robot
from sphero_probe.catalogue.risk import Risk
from sphero_probe.catalogue.stream_plan import sensor_groups
from sphero_probe.cli.complete.last_scan import recall
from sphero_probe.protocol.packets import Generation
from sphero_probe.runs.store import LAST, journal_files
from sphero_probe.transports.registry import SCHEMES

if TYPE_CHECKING:
    from collections.abc import Callable

    Offers = list[CompletionItem[str]]  # not generic in older releases of click

_PLAIN: Final = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.")
_BUILT_IN: Final = "fake:"
_RECORDED: Final = "replay:"


def offer_devices(_: Context, start: str) -> "Offers":
    """Offer the robots of the last scan, the built-in ones, and the other kinds of address.

    After ``replay:``, offer the recorded runs and files.
    """
    if start.startswith(_RECORDED):
        kept = (str(path) for path in journal_files())
        words: dict[str, str] = {
            f"{_RECORDED}{path}": "" for path in kept if (_PLAIN | {"/"}).issuperset(path)
        }
        return [*_beginning(start, words), CompletionItem(start.removeprefix(_RECORDED), type="file")]
    words = {}
    scheme = "ble:" if start.startswith("ble:") else ""
    for robot in recall():
        words[scheme + robot.name] = robot.model
        if start and robot.address:
            name = "" if robot.name == robot.address else robot.name
            words[scheme + robot.address] = f"{name} {robot.model}".strip()
    words |= {f"{_BUILT_IN}{key}": f"built-in {robot.name}" for key, robot in ROBOTS.items()}
    words |= {f"{name}:": "" for name in SCHEMES if f"{name}:" != _BUILT_IN}
    return _beginning(start, words)


def offer_commands(context: Context, start: str) -> "Offers":
    """Offer the names of the commands of the ``--device`` robot; only for the first word."""
    if context.params.get("what"):
        return []
    robot = _robot(context)
    rows = commands_of(robot) if robot else all_rows(_generation(context))
    return _beginning(start, {row.name: row.risk.word for row in rows if row.kind is Kind.COMMAND})


def offer_sensors(context: Context, start: str) -> "Offers":
    """Offer the sensors of the ``--device`` robot, or of every robot."""
    robot = _robot(context)
    groups = [sensor_groups(one) for one in ([robot] if robot else ROBOTS.values())]
    return _beginning(start, {name: "" for group in groups for name in group})


def offer_filters(_: Context, start: str) -> "Offers":
    """Offer the filters of ``catalog``: names of both generations, and risk classes."""
    words = {risk.word: "" for risk in Risk}
    words |= {row.name: row.risk.word for generation in Generation for row in all_rows(generation)}
    return _beginning(start, words)


def offer_dids(context: Context, start: str) -> "Offers":
    """Offer the names of devices, also after a comma."""
    robot = _robot(context)
    names = DEVICE_NAMES[robot.generation if robot else _generation(context)]
    before, comma, _ = start.rpartition(",")
    return _beginning(start, {before + comma + name: f"0x{did:02x}" for did, name in names.items()})


def offer_robots(_: Context, start: str) -> "Offers":
    """Offer the models."""
    return _beginning(start, {key: robot.name for key, robot in ROBOTS.items()})


def offer_plans(_: Context, start: str) -> "Offers":
    """Offer the shipped plans, and files."""
    from sphero_probe.probing.plans.shipped import plan_files  # noqa: PLC0415 - slow, and only plans need it

    names = [path.stem for path in plan_files()] + [f"{library}-claims" for library in INSTALLED]
    return _beginning(start, dict.fromkeys(names, "")) + offer_files(_, start)


def offer_devices_and_commands(_: Context, start: str) -> "Offers":
    """Offer the names of devices and commands of both generations."""
    words = {name: "" for names in DEVICE_NAMES.values() for name in names.values()}
    rows = (row for generation in Generation for row in all_rows(generation) if row.kind is Kind.COMMAND)
    return _beginning(start, words | {row.name: row.risk.word for row in rows})


def offer_runs(_: Context, start: str) -> "Offers":
    """Offer the recorded runs, newest first, and files."""
    kept = (path.stem for path in journal_files())
    words = {LAST: "the newest run"} | {stem: "" for stem in kept if _PLAIN.issuperset(stem)}
    return _beginning(start, words) + offer_files(_, start)


def offer_leds(context: Context, start: str) -> "Offers":
    """Offer the LEDs of the robot of ``--device``, or of every robot."""
    robot = _robot(context)
    tables = [one.leds for one in ((robot,) if robot else ROBOTS.values()) if one.leds]
    groups = [group for table in tables for group in table.groups]
    return _beginning(start, {f"{name}=": "" for group in groups for name in (group.name, *group.aliases)})


def offer_nodes(context: Context, start: str) -> "Offers":
    """Offer the nodes of the robot of ``--device``, or the usual ones."""
    robot = _robot(context)
    names = robot.nodes.values() if robot else ("primary", "secondary")
    return _beginning(start, dict.fromkeys((*names, "none"), ""))


def offer_files(_: Context, start: str) -> "Offers":
    """Let the shell offer files."""
    return [CompletionItem(start, type="file")]


def offer_libraries(_: Context, start: str) -> "Offers":
    """Offer the libraries that are known by name, and files."""
    return _beginning(start, dict.fromkeys(INSTALLED, "")) + offer_files(_, start)


OFFERS: Final["dict[str, Callable[[Context, str], Offers]]"] = {
    "commands": offer_commands,
    "devices": offer_devices,
    "dids": offer_dids,
    "files": offer_files,
    "filters": offer_filters,
    "leds": offer_leds,
    "libraries": offer_libraries,
    "sensors": offer_sensors,
    "nodes": offer_nodes,
    "plans": offer_plans,
    "robots": offer_robots,
    "runs": offer_runs,
    "what": offer_devices_and_commands,
}
"""Kind -> the function that returns its candidates."""


def _beginning(start: str, words: dict[str, str]) -> "Offers":
    return [CompletionItem(word, help=said or None) for word, said in words.items() if word.startswith(start)]


def _robot(context: Context) -> Robot | None:
    """Return the model of ``--device``, if the address alone names one."""
    device = str(context.params.get("connecting_device") or "")
    scheme, colon, rest = device.partition(":")
    if scheme == "fake" and colon:
        return robot_by_word(rest.partition("?")[0])
    return robot_by_prefix(rest if scheme == "ble" and colon else device)


def _generation(context: Context) -> Generation:
    return Generation.V1 if context.params.get("v1") else Generation.V2
