"""Opening a session as the connect options say."""

from contextlib import AbstractAsyncContextManager
from time import monotonic

from sphero_probe.cli.output import say
from sphero_probe.link.policy import Consent
from sphero_probe.session.session import Session, open_session
from sphero_probe.transports.base import OpenOptions


def connect(
    device: str,
    consent: Consent,
    *,
    adapter: str = "",
    connect_timeout: float = 10.0,
    verbose: bool = False,
    timeout: float | None = None,
) -> AbstractAsyncContextManager[Session]:
    """Return the session to enter; with ``verbose`` each step is printed with its time."""
    began = monotonic()

    def on_step(step: str) -> None:
        if verbose:
            say(f"{monotonic() - began:7.3f} s  {step}")

    return open_session(device, consent, OpenOptions(connect_timeout, adapter, on_step), timeout=timeout)
