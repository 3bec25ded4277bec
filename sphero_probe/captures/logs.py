"""Lines of other tools' logs: who sent which bytes, and when.

nRF Connect, LightBlue, bluetoothctl, btmon, the debug output of libraries, and any line with an arrow or TX
and RX. A line without a direction, a time or bytes in a usual form says nothing.
"""

import re
from typing import Final, NamedTuple

from sphero_probe.captures.pasted import pasted_bytes
from sphero_probe.errors import UsageError

_UUID: Final = re.compile(r"[0-9a-f]{8}-(?:[0-9a-f]{4}-){3}[0-9a-f]{12}", re.IGNORECASE)
_PATH: Final = re.compile(r"/\S*|\b\w+[0-9a-f]{4}\b(?=[/\]])")
_MAC: Final = re.compile(
    r"(?<![0-9a-f:])(?!ff:f[89a-f])(?:[0-9a-f]{2}:){5}[0-9a-f]{2}(?![0-9a-f:])", re.IGNORECASE
)
_TIME: Final = re.compile(
    r"(?<![:\w])(?:\d{4}[-/]\d\d[-/]\d\d[T ])?\d{1,2}:\d\d:\d\d(?:[.,]\d{1,9})?(?:Z|[+-]\d\d:?\d\d)?"
)
_TO: Final = re.compile(
    r"-+>|=+>|>>+|→|\b(?:tx|send|sending|sent|wrote|request|command|cmd)\b|\bwrit(?:e|ing|ten)",
    re.IGNORECASE,
)
_FROM: Final = re.compile(
    r"<-+|<=+|<<+|←|\b(?:rx|recv|receive|received|receiving|read|notif(?:y|ied|ication)|indication|response"
    r"|packet|answer|updated)\b|\bChanged\b",
    re.IGNORECASE,
)
_BTMON: Final = re.compile(r"^([<>]) ACL")
_BTMON_ATT: Final = re.compile(r"^\s+ATT: ([\w ]+?) \(0x")
_BTMON_DATA: Final = re.compile(r"^\s+Data(?:\[\d+\])?: ([0-9a-f]+)\s*$")
_BLUETOOTHCTL: Final = re.compile(r"^(?:\x1b\[[\d;]*m)*\[?(?:CHG|NEW)?.*Attribute .*Value:\s*$")
_BLOCK: Final = re.compile(r"^\s*((?:[0-9a-f]{2} ){1,16}) {2,}.{1,16}\s*$")
_ANSI: Final = re.compile(r"\x1b\[[\d;?]*[A-Za-z]|[\x01\x02]")
_RUN: Final = re.compile(
    r"(?:\(0x\)\s*)?(?:0x)?[0-9a-f]{2}(?:-[0-9a-f]{2}){2,}"
    r"|bytearray\(b(?:'[^']*'|\"[^\"]*\")\)|b'(?:[^'\\]|\\.)*\\x(?:[^'\\]|\\.)*'|b\"(?:[^\"\\]|\\.)*\\x(?:[^\"\\]|\\.)*\""
    r"|(?:\\x[0-9a-f]{2}){2,}"
    r"|<(?:Buffer )?[0-9a-f][0-9a-f ]*>|\{length = \d+, bytes = 0x[0-9a-f ]+\}"
    r"|\[-?[0-9a-fx]+(?:[, ]+-?[0-9a-fx]+)+,?\s*\]"
    r"|(?<![0-9a-z])(?:0x)?[0-9a-f]{1,2}(?:(?:, ?|:| )(?:0x)?[0-9a-f]{1,2}){2,}(?![0-9a-z])"
    r"|(?<![0-9a-z])(?:0x)?(?:[0-9a-f]{2}){4,}(?![0-9a-z])",
    re.IGNORECASE,
)
_SAME: Final = 4
"""Lines after which the same bytes in another kind of line are another packet."""


class Said(NamedTuple):
    """What a line says.

    Attributes:
        time: as the log writes it, None where it has none.
        to_robot: True for what was sent to the robot, False for what came from it, None where it is not said.
        data: the bytes.
        bare: there is nothing else in the line.
    """

    time: str | None
    to_robot: bool | None
    data: bytes
    bare: bool = False


class LogReader:
    """Reads a log line by line; some tools spread a packet over several, or tell it several times."""

    def __init__(self) -> None:
        self._sent: bool | None = None
        self._att = False
        self._block = False
        self._time: str | None = None
        self._before: list[tuple[str, bool | None, bytes]] = []

    def feed(self, line: str) -> Said | None:
        """Take the next line; return what it says, None where it says nothing.

        Raises:
            UsageError: it says what was sent or received, but that may stand for different bytes.
        """
        line = _ANSI.sub("", line)[:_MAX_LINE]
        if found := _BTMON.match(line):
            self._sent, self._att = found[1] == "<", False
            self._time = None
            return None
        if found := _BTMON_ATT.match(line):
            self._att = found[1] in _CARRIERS
            return None
        if found := _BTMON_DATA.match(line):
            att, self._att = self._att, False
            return Said(None, self._sent, bytes.fromhex(found[1])) if att and not len(found[1]) % 2 else None
        if _BLUETOOTHCTL.match(line):
            self._block = True
            return None
        if self._block and (found := _BLOCK.match(line)):
            return Said(None, False, bytes.fromhex(found[1]))
        self._block = False
        return self._one(line)

    def _one(self, line: str) -> Said | None:
        time = _TIME.search(line)
        rest = _UUID.sub(" ", line.replace(time[0], " ", 1) if time else line)
        runs = list(_RUN.finditer(_hidden(rest)))
        if not runs:
            return None
        run = next((each for each in runs if _starts(each[0])), runs[-1])
        words = rest[: run.start()] + " " + rest[run.end() :]
        to_robot = _direction(words)
        try:
            data = pasted_bytes(run[0])
        except UsageError:
            if to_robot is None:
                return None
            raise
        if not data:
            return None
        kind = re.sub(r"\W+|\d", "", words).lower()
        if self._is_told_again(kind, to_robot, data):
            return None
        return Said(time[0] if time else None, to_robot, data)

    def _is_told_again(self, kind: str, to_robot: bool | None, data: bytes) -> bool:
        """Whether a line before, worded otherwise, told the same bytes in the same direction."""
        again = any(
            said == data and way == to_robot and worded != kind for worded, way, said in self._before[-_SAME:]
        )
        if again:
            return True
        self._before = [*self._before[-_SAME:], (kind, to_robot, data)]
        return False


_MAX_LINE: Final = 1 << 14
_CARRIERS: Final = frozenset(
    {
        "Write Command",
        "Write Request",
        "Handle Value Notification",
        "Handle Value Indication",
        "Prepare Write Request",
    }
)


def _hidden(line: str) -> str:
    """Return the line with addresses and, where more than that is in it, paths blanked out."""
    line = _MAC.sub(lambda found: " " * len(found[0]), line)
    without = _PATH.sub(lambda found: " " * len(found[0]), line)
    return without if _RUN.search(without) else line


def starts_frame(data: bytes) -> bool:
    """Whether bytes begin as a frame of either generation does."""
    return data[:1] == b"\x8d" or (data[:1] == b"\xff" and data[1:2] >= b"\xf8")


def may_start_frame(data: bytes) -> bool:
    """Whether bytes begin as a frame does, or may once more of them are there."""
    return starts_frame(data) or data == b"\xff"


def _starts(run: str) -> bool:
    try:
        return starts_frame(pasted_bytes(run) or b"")
    except UsageError:
        return False


def _direction(words: str) -> bool | None:
    sent, heard = _TO.search(words), _FROM.search(words)
    if sent and heard:
        return sent.start() < heard.start()
    return True if sent else False if heard else None
