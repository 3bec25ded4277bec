"""Load plan files, and check the plan and the probes of each stage.

A plan is code that its user runs. It may raise anything or never end; both raise ``BadInputFileError`` with
the file and the line.
"""

import signal
import traceback
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from threading import current_thread, main_thread
from types import FrameType
from typing import Final

from sphero_probe.errors import BadInputFileError
from sphero_probe.probing.finding import Finding
from sphero_probe.probing.packed_probes import PackedProbes
from sphero_probe.probing.plan import Plan, Probe, Stage
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Command

MAX_PROBES: Final = 4 * 65536
"""Probes in one stage: every DID and CID on four nodes. With more, the plan counts as endless."""
MAX_STAGES: Final = 1000
MAX_PAYLOAD: Final = max(codec.max_payload for codec in CODECS.values())
MAX_SECONDS = 5.0
"""Seconds that a plan's own code may take each time it runs."""
MAX_FILE: Final = 1 << 20
"""Bytes of a plan file."""


def probes_of(plan: Plan, stage: Stage, findings: Sequence[Finding]) -> PackedProbes:
    """Return the probes of a stage, checked.

    Args:
        plan: whose stage it is.
        stage: probes, or what makes them.
        findings: so far, for a stage that is made from them.

    Raises:
        BadInputFileError: the stage's code raises, does not end, or yields anything but probes.
    """
    where = plan.file or plan.name
    with _watched(plan.file):
        return PackedProbes(_checked_probes(stage(findings) if callable(stage) else stage, where))
    raise AssertionError("_watched suppresses no error")


def _checked_probes(made: Iterable[object], where: object) -> Iterator[Probe]:
    """Yield what a stage made.

    Raises:
        BadInputFileError: there are too many, or one is not a probe or cannot be sent.
    """
    for count, probe in enumerate(made, 1):
        if count > MAX_PROBES:
            raise BadInputFileError(f"{where}: a stage of more than {MAX_PROBES} probes")
        if not isinstance(probe, Probe):
            raise BadInputFileError(
                f"{where}: a stage holds {_short(probe)}, not a Probe", "write Probe(Command(did, cid))"
            )
        if problem := _problem(probe.command):
            raise BadInputFileError(f"{where}: {problem}", "write Probe(Command(0x13, 0x10))")
        yield probe


def load_plan(path: Path) -> Plan:
    """Run a plan file and return its ``PLAN``.

    Raises:
        BadInputFileError: it cannot be read or run, does not end, or defines no usable ``PLAN``.
    """
    try:
        with path.open("rb") as file:
            source = file.read(MAX_FILE + 1)
    except OSError as error:
        raise BadInputFileError(f"{path}: {error.strerror}", "see: sphero-probe plan list") from error
    if len(source) > MAX_FILE:
        raise BadInputFileError(f"{path}: larger than {MAX_FILE} bytes: not a plan")
    space: dict[str, object] = {"__name__": f"probe_plan_{path.stem}", "__file__": str(path)}
    with _watched(path):
        exec(compile(source, str(path), "exec"), space)  # noqa: S102 - a plan is code that its user runs
        plan = space.get("PLAN")
        if not isinstance(plan, Plan):
            said = "defines no PLAN" if plan is None else f"PLAN is {_short(plan)}, not a Plan"
            raise BadInputFileError(f"{path}: {said}", "see: sphero-probe plan show hello")
        return _checked(plan, path)
    raise AssertionError("_watched suppresses no error")


class _TooLong(BaseException):
    """The plan's code ran too long; no ``except Exception`` of its own may swallow this."""


@contextmanager
def _watched(file: Path | None) -> Iterator[None]:
    """Run a plan's own code, which may raise anything or never end.

    Raises:
        BadInputFileError: it raised or did not end; with the file and the line.
    """
    try:
        with _alarm():
            yield
    except BadInputFileError:
        raise
    except _TooLong as error:
        raise BadInputFileError(
            f"{_place(error, file)}: still running after {MAX_SECONDS:g} s", "a plan must end by itself"
        ) from error
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise BadInputFileError(f"{_place(error, file)}: {_said(error)}") from error


@contextmanager
def _alarm() -> Iterator[None]:
    """Interrupt the block after ``MAX_SECONDS`` seconds, if the system has an alarm clock."""
    if not hasattr(signal, "setitimer") or current_thread() is not main_thread():
        yield  # on Windows and in threads, only Ctrl-C interrupts
        return

    def ring(_number: int, _frame: FrameType | None) -> None:
        raise _TooLong

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, MAX_SECONDS, 0.1)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _place(error: BaseException, file: Path | None) -> str:
    """Return the file and the innermost line of the plan that raised an error."""
    if isinstance(error, SyntaxError) and error.filename == str(file) and error.lineno:
        return f"{file}:{error.lineno}"
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(file)]
    return f"{file}:{lines[-1]}" if lines else str(file or "plan")


def _said(error: BaseException) -> str:
    """Return an error's class and the first line of its text."""
    try:
        text = str(error).partition("\n")[0]
    except BaseException as mute:
        if isinstance(mute, _TooLong | KeyboardInterrupt):
            raise
        text = ""
    return f"{type(error).__name__}{': ' if text else ''}{text}"


def _short(value: object) -> str:
    try:
        text = repr(value)
    except BaseException as mute:
        if isinstance(mute, _TooLong | KeyboardInterrupt):
            raise
        text = f"a {type(value).__name__}"
    return text if len(text) <= 60 else text[:57] + "..."


def _problem(command: object) -> str:
    """Return what is wrong with a probe's command; empty if nothing is."""
    if not isinstance(command, Command):
        return f"a probe of {_short(command)}, not a Command"
    numbers: dict[str, object] = {"did": command.did, "cid": command.cid, "target": command.target}
    for name, value in numbers.items():
        if value is None and name == "target":
            continue
        if not isinstance(value, int) or not 0 <= value <= 0xFF:
            return f"{name} is {_short(value)}, not a number from 0 to 255"
    payload: object = command.payload
    if not isinstance(payload, bytes):
        return f"payload is {_short(payload)}, not bytes"
    return "" if len(payload) <= MAX_PAYLOAD else f"payload of {len(payload)} bytes does not fit into a frame"


def _checked(plan: Plan, path: Path) -> Plan:
    """Return the plan, after checking the types of its parts."""
    parts: dict[str, object] = {"name": plan.name, "summary": plan.summary}
    if not all(isinstance(part, str) for part in parts.values()):
        raise BadInputFileError(f"{path}: a plan's name and summary must be texts")
    stages: object = plan.stages
    if not isinstance(stages, list | tuple) or len(stages) > MAX_STAGES:
        raise BadInputFileError(f"{path}: a plan's stages must be a list of at most {MAX_STAGES}")
    for stage in stages:
        if not callable(stage) and not isinstance(stage, Iterable):
            raise BadInputFileError(f"{path}: a stage is {_short(stage)}, not probes and not a function")
    robots: object = plan.robots
    if not isinstance(robots, list | tuple) or not all(isinstance(robot, str) for robot in robots):
        raise BadInputFileError(f"{path}: a plan's robots are {_short(robots)}, not a tuple of keys")
    names: object = plan.stage_names
    if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
        raise BadInputFileError(f"{path}: a plan's stage_names are {_short(names)}, not a list of texts")
    return replace(plan, robots=tuple(robots), stage_names=tuple(names), file=path)
