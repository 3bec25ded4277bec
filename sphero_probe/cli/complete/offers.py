"""What the shell may offer: the beginning of a word goes in, the words that begin so come out."""

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from click import Context, Parameter
    from click.shell_completion import CompletionItem

    from sphero_probe.catalogue.model import Robot
    from sphero_probe.protocol.packets import Generation

    Offers = list[CompletionItem[str]]

_PLAIN: Final = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.")
_BUILT_IN: Final = "fake:"


def offer_devices(_: "Context", __: "Parameter", start: str) -> "Offers":
    """Offer the robots of the last scan, the built-in ones, and the other kinds of address."""
    from sphero_probe.catalogue import ROBOTS
    from sphero_probe.cli.complete.last_scan import recall
    from sphero_probe.transports.registry import SCHEMES

    words: dict[str, str] = {}
    scheme = "ble:" if start.startswith("ble:") else ""
    for robot in recall():
        words[scheme + robot.name] = robot.model
        if start and robot.address:
            name = "" if robot.name == robot.address else robot.name
            words[scheme + robot.address] = f"{name} {robot.model}".strip()
    words |= {f"{_BUILT_IN}{key}": f"built-in {robot.name}" for key, robot in ROBOTS.items()}
    words |= {f"{name}:": "" for name in SCHEMES if f"{name}:" != _BUILT_IN}
    return _beginning(start, words)


def offer_commands(context: "Context", _: "Parameter", start: str) -> "Offers":
    """Offer the names of commands, as the robot of ``--device`` has them; only for the first word."""
    from sphero_probe.catalogue import all_rows, commands_of
    from sphero_probe.catalogue.model import Kind

    if context.params.get("what"):
        return []
    robot = _robot(context)
    rows = commands_of(robot) if robot else all_rows(_generation(context))
    return _beginning(start, {row.name: row.risk.word for row in rows if row.kind is Kind.COMMAND})


def offer_filters(_: "Context", __: "Parameter", start: str) -> "Offers":
    """Offer what ``catalog`` can filter by: names of either generation, and risk classes."""
    from sphero_probe.catalogue import all_rows
    from sphero_probe.catalogue.risk import Risk
    from sphero_probe.protocol.packets import Generation

    words = {risk.word: "" for risk in Risk}
    words |= {row.name: row.risk.word for generation in Generation for row in all_rows(generation)}
    return _beginning(start, words)


def offer_dids(context: "Context", __: "Parameter", start: str) -> "Offers":
    """Offer the names of devices, also after a comma."""
    from sphero_probe.catalogue import DEVICE_NAMES

    robot = _robot(context)
    names = DEVICE_NAMES[robot.generation if robot else _generation(context)]
    before, comma, _ = start.rpartition(",")
    return _beginning(start, {before + comma + name: f"0x{did:02x}" for did, name in names.items()})


def offer_robots(_: "Context", __: "Parameter", start: str) -> "Offers":
    """Offer the models."""
    from sphero_probe.catalogue import ROBOTS

    return _beginning(start, {key: robot.name for key, robot in ROBOTS.items()})


def offer_plans(_: "Context", __: "Parameter", start: str) -> "Offers":
    """Offer the plans that come with the tool, and files."""
    from sphero_probe.probing.plans.shipped import plan_files

    return _beginning(start, {path.stem: "" for path in plan_files()}) + _files(start)


def offer_runs(_: "Context", __: "Parameter", start: str) -> "Offers":
    """Offer the kept runs, the last one first, and files."""
    from sphero_probe.runs.store import LAST, journal_files

    kept = (path.stem for path in journal_files())
    words = {LAST: "the run that was kept last"} | {stem: "" for stem in kept if _PLAIN.issuperset(stem)}
    return _beginning(start, words) + _files(start)


def offer_lamps(context: "Context", _: "Parameter", start: str) -> "Offers":
    """Offer the lamps of the robot of ``--device``, or of every robot."""
    from sphero_probe.catalogue import ROBOTS

    robot = _robot(context)
    tables = [one.leds for one in ((robot,) if robot else ROBOTS.values()) if one.leds]
    groups = [group for table in tables for group in table.groups]
    return _beginning(start, {f"{name}=": "" for group in groups for name in (group.name, *group.aliases)})


def offer_nodes(context: "Context", _: "Parameter", start: str) -> "Offers":
    """Offer the nodes of the robot of ``--device``, or the usual ones."""
    robot = _robot(context)
    names = robot.nodes.values() if robot else ("primary", "secondary")
    return _beginning(start, dict.fromkeys((*names, "none"), ""))


def offer_files(_: "Context", __: "Parameter", start: str) -> "Offers":
    """Leave it to the shell to offer files."""
    return _files(start)


def _files(start: str) -> "Offers":
    from click.shell_completion import CompletionItem

    return [CompletionItem(start, type="file")]


def _beginning(start: str, words: "dict[str, str]") -> "Offers":
    from click.shell_completion import CompletionItem

    return [CompletionItem(word, help=said or None) for word, said in words.items() if word.startswith(start)]


def _robot(context: "Context") -> "Robot | None":
    """Return the model that ``--device`` tells, as far as it tells one without asking the air."""
    from sphero_probe.catalogue import robot_by_prefix, robot_by_word

    device = str(context.params.get("device") or "")
    scheme, colon, rest = device.partition(":")
    if scheme == "fake" and colon:
        return robot_by_word(rest.partition("?")[0])
    return robot_by_prefix(rest if scheme == "ble" and colon else device)


def _generation(context: "Context") -> "Generation":
    from sphero_probe.protocol.packets import Generation

    return Generation.V1 if context.params.get("v1") else Generation.V2
