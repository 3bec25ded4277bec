"""Printing how to resume a run that ended early."""

from collections.abc import Iterator
from contextlib import contextmanager

from sphero_probe.cli.invoke import InterruptedRunError
from sphero_probe.cli.output import say
from sphero_probe.errors import IncompleteError, LinkLostError, OutputError, SpheroProbeError
from sphero_probe.link.policy import Consent
from sphero_probe.runs.resume import RunJournal


@contextmanager
def resume_hint(journal: RunJournal, device: str, consent: Consent) -> Iterator[None]:
    """Let an early end pass, with the command line that resumes the run.

    Args:
        journal: of the run.
        device: the robot's address as it was given, empty for none.
        consent: what was allowed.
    """

    def hint() -> str:
        command = journal.resume_command(device, consent)
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
