"""Opens the journal of a command, and prints how to resume a run that ended early."""

from collections.abc import Iterator
from contextlib import contextmanager

from sphero_probe.cli.messages import say, warn
from sphero_probe.cli.values import ConnectOptions, JournalOptions
from sphero_probe.errors import (
    IncompleteError,
    InterruptedRunError,
    LinkLostError,
    OutputError,
    SpheroProbeError,
)
from sphero_probe.link.policy import Consent
from sphero_probe.runs.resume import RunJournal


def run_journal(command: str, options: JournalOptions) -> RunJournal:
    """Return the journal to enter; print a warning if none can be written in the folder of runs.

    Args:
        command: whose run it is: ``sweep``, ``send``, …
        options: which journal to keep.
    """
    return RunJournal(command, file=options.file, off=options.off, resume=options.resume, on_warning=warn)


@contextmanager
def resume_hint(journal: RunJournal, connecting: ConnectOptions, consent: Consent) -> Iterator[None]:
    """Print the command line that resumes the run, if it ends early.

    Args:
        journal: of the run.
        connecting: which robot, and how its answers may differ.
        consent: what was allowed.
    """

    def hint() -> str:
        command = journal.resume_command(connecting.device, consent, connecting.tolerate)
        return f"resume: {command}" if command else ""

    try:
        yield
    except (LinkLostError, OutputError, IncompleteError) as error:
        error.hint = hint() or error.hint
        raise
    except (SpheroProbeError, BrokenPipeError):
        raise
    except (InterruptedRunError, KeyboardInterrupt, OSError):
        if text := hint():
            say(text, limit=None)
        raise
