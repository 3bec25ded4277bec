"""Says why a run is incomplete, and where the link dropped, for the end of its report and for messages."""

from typing import Final

from sphero_probe.catalogue import ROBOTS
from sphero_probe.catalogue.well_known import WellKnown, row_for
from sphero_probe.probing.finding import Outcome
from sphero_probe.probing.notes import EXECUTED
from sphero_probe.probing.retries import DEAD, LOST, SUSPECT
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Generation, Verdict
from sphero_probe.reports.phrases import pair, shown
from sphero_probe.reports.rows import Row

_EXECUTED: Final = "a wrong length was executed, so its node got no further wrong length"
_GAVE_UP: Final = "a node does not answer as it should and was given up"
_UNAVAILABLE: Final = "a node was unavailable"
_LOST: Final = "the link was lost"
_STOPPED: Final = "it was stopped before everything was asked"


class RunEnding:
    """Collects the reasons why a run is incomplete, and the commands that dropped the link."""

    def __init__(self) -> None:
        self._suspects: list[str] = []
        self._generation: Generation | None = None
        self._reasons: set[str] = set()

    def add(self, row: Row) -> None:
        """Look at the next row of a run; rows of other types say nothing about its end."""
        data = row.data
        if row.type == "run":
            robot = ROBOTS.get(shown(data.get("robot")))
            self._generation = robot.generation if robot else None
        elif row.type == "note" and data.get("kind") == EXECUTED:
            self._reasons.add(_EXECUTED)
        elif row.type == "finding" and data.get("note") == DEAD:
            self._reasons.add(_GAVE_UP)
        elif row.type == "finding" and data.get("note") == LOST:
            self._reasons.add(_LOST)
        elif row.type == "finding" and data.get("note") == SUSPECT:
            self._suspects.append(pair(data))
        elif row.type == "finding" and self._is_unavailable(data):
            self._reasons.add(_UNAVAILABLE)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why the run is incomplete, the most important reason first; without any other, it was stopped."""
        order = (_EXECUTED, _LOST, _GAVE_UP, _UNAVAILABLE)
        return tuple(reason for reason in order if reason in self._reasons) or (_STOPPED,)

    @property
    def dropped(self) -> str:
        """At which commands the link dropped twice, empty if at none."""
        return (
            f"the link dropped twice while {', then '.join(self._suspects)} was in flight"
            if self._suspects
            else ""
        )

    def message(self) -> str:
        """Return the reasons in one sentence."""
        return f"the run is incomplete: {'; '.join(self.reasons)}"

    def _is_unavailable(self, data: dict[str, object]) -> bool:
        """Whether a node said that it is unavailable, or did not answer an echo."""
        if self._generation is None:
            return False
        code = data.get("code")
        if isinstance(code, int):
            return CODECS[self._generation].verdict(code) is Verdict.TARGET_UNAVAILABLE
        echo = row_for(self._generation, WellKnown.ECHO)
        unanswered = data.get("outcome") in (Outcome.SILENT, Outcome.INCONCLUSIVE)
        return unanswered and echo is not None and (data.get("did"), data.get("cid")) == (echo.did, echo.cid)
