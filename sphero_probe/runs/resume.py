"""Keep the journal of one command: create it, or reopen that of an interrupted run and check that it matches.

The check happens before anything is sent. A journal only says what to send; the user must give the robot, the
consent and a plan's code again.
"""

import shlex
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import Self

from sphero_probe.catalogue.risk import Risk
from sphero_probe.errors import (
    BadInputFileError,
    OutputError,
    RefusedByPolicyError,
    UsageError,
)
from sphero_probe.json_files import parse
from sphero_probe.link.policy import Consent
from sphero_probe.probing.attempt import Announce, PreparedProbe
from sphero_probe.probing.finding import Record
from sphero_probe.probing.plan import Plan
from sphero_probe.probing.recorder import PreviousResults
from sphero_probe.runs.decode import Opening, decode, digest_of
from sphero_probe.runs.encode import encode
from sphero_probe.runs.journal import Journal, check_same_robot
from sphero_probe.runs.overview import last_to_resume
from sphero_probe.runs.store import LAST, create_journal, find_journal
from sphero_probe.transports.base import Connection


class RunJournal:
    """Keeps the journal of one command; a context manager that closes it.

    Attributes:
        command: the command that runs: ``sweep``, ``send``, …
        journal: the open journal; None if none is kept, or the robot is not known yet.
        announce: None: a line that is written to a file outlives this process.
        options: the options that select what to send, for the journal's first line; set by the command.
    """

    def __init__(
        self,
        command: str,
        *,
        file: str | None = None,
        off: bool = False,
        resume: str | None = None,
        on_warning: Callable[[str], None] = lambda _: None,
    ) -> None:
        """Choose which journal to keep.

        Args:
            command: the command that runs.
            file: a new journal's path; None for a new file in the folder of runs.
            off: keep no journal.
            resume: the journal to continue, None for a new run.
            on_warning: called if no journal can be kept in the folder of runs.
        """
        self.command = command
        self.journal: Journal | None = None
        self.announce: Announce | None = None
        self.options: dict[str, str] = {}
        self._file, self._off, self._resume = file, off, resume
        self._on_warning = on_warning

    def __enter__(self) -> Self:
        """Open the journal that the options name.

        Raises:
            UsageError: the options contradict each other.
            BadInputFileError: the file to resume is not a journal, or is of another command.
            InUseError: another process is writing it.
            OutputError: it cannot be written.
        """
        file, off, resume = self._file, self._off, self._resume
        if sum((file is not None, off, resume is not None)) > 1:
            raise UsageError("--journal, --no-journal and --resume exclude each other")
        if file is not None:
            self.journal = Journal.create(Path(file))
        elif resume is not None:
            last = last_to_resume(self.command) if resume == LAST else None
            self.journal = Journal.reopen(last or find_journal(resume))
            if self.opening and self.opening.command != self.command:
                self.__exit__()
                raise BadInputFileError(
                    f"{resume}: the journal of {self.opening.command}, not of {self.command}"
                )
        return self

    def __exit__(self, *_: object) -> None:
        if self.journal:
            self.journal.close()

    @property
    def opening(self) -> Opening | None:
        """The first line of the interrupted run's journal, None for a new run."""
        interrupted = self.journal.interrupted if self.journal else None
        return interrupted.opening if interrupted else None

    @property
    def place(self) -> str:
        """The path of the open journal as text, empty if none is open."""
        return str(self.journal.path) if self.journal else ""

    @property
    def earlier(self) -> PreviousResults:
        """What the interrupted run has settled."""
        interrupted = self.journal.interrupted if self.journal else None
        return interrupted.earlier if interrupted else PreviousResults()

    def check(self, plan: Plan, consent: Consent, target: str | None) -> str | None:
        """Compare the plan, node and consent with those of the interrupted run; return the node to probe.

        Raises:
            BadInputFileError: that run had another plan or another node.
            RefusedByPolicyError: that run had another consent.
        """
        opening, journal = self.opening, self.journal
        if opening is None or journal is None:
            return target
        if opening.digest != digest_of(plan):
            raise BadInputFileError(f"{journal.path}: the journal of another plan, not of {plan.name}")
        if target is not None and target != opening.target:
            said = opening.target or "the robot's usual node"
            raise BadInputFileError(f"{journal.path}: the journal of another node: {said}")
        if set(opening.consent) != set(consent.words):
            raise RefusedByPolicyError(
                f"{journal.path}: this run was allowed {', '.join(opening.consent)}; now it is "
                f"{', '.join(consent.words)}",
                f"resume it with {' '.join(_allowing(opening.consent)) or 'no --allow'}",
            )
        return opening.target or None

    def begin(self, connection: Connection, plan: Plan, consent: Consent, target: str | None) -> None:
        """Write the first line of a new journal, or compare the robot with that of the interrupted run.

        Raises:
            BadInputFileError: the interrupted run probed another robot.
            OutputError: a journal that the user named cannot be written.
        """
        opening = Opening(
            self.command,
            plan.name,
            digest_of(plan),
            self.options,
            target or "",
            connection.address,
            connection.generation,
            connection.robot.key if connection.robot else "",
            connection.name,
            consent.words,
        )
        if self.opening and self.journal:
            check_same_robot(self.opening, opening, self.journal.path)
        elif self.journal:
            self.journal.open(opening)
        elif not self._off:
            self._begin_in_folder(opening, encode(opening))

    def append(self, lines: bytes) -> None:
        """Write whole lines of this run that another process has made.

        Args:
            lines: of the journal; those of a new run begin with the opening.

        Raises:
            BadLineError: the first line of a new journal is not an opening.
            OutputError: a journal that the user named cannot be written.
        """
        if self.journal:
            self.journal.append(lines)
        elif not self._off:
            opening = decode(parse(lines.partition(b"\n")[0]), None)
            assert isinstance(opening, Opening)
            self._begin_in_folder(opening, lines)

    def _begin_in_folder(self, opening: Opening, lines: bytes) -> None:
        try:
            self.journal = create_journal(opening.device, opening.plan, now=datetime.now(UTC))
            self.journal.append(lines)
        except OutputError as error:
            if self.journal:
                self.journal.close()
                self.journal = None
            self._off = True
            self._on_warning(f"no journal is kept: {error}")

    def intend(self, probe: PreparedProbe) -> None:
        """Record that a probe is about to be sent.

        Raises:
            OutputError: it cannot be written.
        """
        if self.journal:
            self.journal.intend(probe)

    def record(self, record: Record) -> None:
        """Write a record of the run.

        Raises:
            OutputError: it cannot be written.
            BadInputFileError: this is another robot than before.
        """
        if self.journal:
            self.journal.record(record)

    def resume_command(self, device: str, consent: Consent, tolerate: Iterable[str] = ()) -> str:
        """Return the command line that resumes this run, empty if it cannot be resumed.

        Args:
            device: the robot's address as it was given, empty for none.
            consent: what was allowed.
            tolerate: in what answers were allowed to differ.
        """
        if self.journal is None or not self.journal.resumable:
            return ""
        words = ["sphero-probe", self.command, "--resume", str(self.journal.path)]
        if file := self.options.get("plan_file"):
            words += ["--plan", file]
        if file := self.options.get("plan_from"):
            words += ["--plan-from", file]
        if device:
            words += ["--device", device]
        words += _allowing(consent.words)
        if consent.confirmed:
            words += ["--confirm", consent.confirmed]
        words += [part for word in tolerate for part in ("--tolerate", word)]
        return shlex.join(words)


def _allowing(words: tuple[str, ...]) -> list[str]:
    """Return the options that allow these classes; the default classes need none."""
    default = {Risk.READ.word, Risk.PROBE.word}
    return [part for word in words if word not in default for part in ("--allow", word)]
