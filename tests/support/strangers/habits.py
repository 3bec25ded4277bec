"""The strangers by name: the behaviour of each, and what is expected of a run on it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Final

from tests.support.strangers.commands import BB8, BOLT, R2, RVR, Effect, Row
from tests.support.strangers.firmware import (
    Check,
    Claims,
    Code,
    Firmware,
    Moment,
    Nothing,
    Voice,
    Word,
    honest,
)
from tests.support.strangers.frames import Answer


class Expect(Enum):
    """What is expected of a run on a stranger, beyond what is expected on every stranger."""

    SURE = auto()
    """It checks lengths and answers in time: at most one finding in a hundred may be inconclusive."""
    MUTE = auto()
    """None of its responses match a command: the run ends early and says what is odd."""
    TOLERABLE = auto()
    """As above, or the run accepts the responses, and its findings are true."""
    INCOMPLETE = auto()
    """A part of it cannot be probed: the run says that it is incomplete."""
    COMPARED = auto()
    """Its claims are compared with its commands, completely."""
    BLIND = auto()
    """Its responses do not reveal what it executes: only commands in the catalogue can be held back."""
    MEAGRE = auto()
    """Some of its documented reads never succeed."""


@dataclass(frozen=True, kw_only=True)
class Stranger:
    """One robot with unusual behaviour.

    Attributes:
        name: short, for the tables.
        habit: what it does, in a line.
        model: the model that the run assumes.
        firmware: what exists and how requests are checked.
        voice: what happens to its answers.
        expect: what is expected of a run on it.
        oddity: a pattern for the error's text, if none of its responses match a command.
        few: only a few commands are sent, because each takes long.
    """

    name: str
    habit: str
    model: str = "bolt"
    firmware: Firmware
    voice: Voice = field(default_factory=Voice)
    expect: frozenset[Expect] = frozenset()
    oddity: str = ""
    few: bool = False


_SURE = frozenset({Expect.SURE})
_MEAGRE = frozenset({Expect.MEAGRE})
_MUTE = frozenset({Expect.MUTE, Expect.MEAGRE})
STRANGERS: Final[list[Stranger]] = []


def _add(name: str, habit: str, firmware: Firmware | tuple[Row, ...], **more: object) -> None:
    if isinstance(firmware, tuple):
        firmware = Firmware(rows=firmware)
    STRANGERS.append(Stranger(name=name, habit=habit, firmware=firmware, **more))  # type: ignore[arg-type]


def _lax(which: Callable[[Row], bool], how: Check = Check.SURPLUS_IGNORED) -> Callable[[Row], Check]:
    return lambda row: how if which(row) else Check.EXACT


def _acts(row: Row) -> bool:
    return row.effect > Effect.READ


# --- controls: nothing is odd, so nothing may be in doubt --------------------------------------------------

_add("plain bolt", "strict everywhere, answers at once", BOLT, expect=_SURE | {Expect.COMPARED})
_add("plain rvr", "the same, with error codes on demand", RVR, model="rvr", expect=_SURE | {Expect.COMPARED})
_add("plain r2", "the same on one node", R2, model="r2d2", expect=_SURE | {Expect.COMPARED})

# --- lengths: each handler as it was written ---------------------------------------------------------------

_add(
    "setters ignore surplus",
    "reads are strict, every other command ignores surplus bytes",
    Firmware(rows=BOLT, check=_lax(_acts)),
)
_add(
    "setters check nothing",
    "reads are strict, every other command runs with any length",
    Firmware(rows=R2, check=_lax(_acts, Check.NONE)),
    model="r2d2",
)
_add(
    "setters check the upper bound",
    "reads are strict, every other command runs with too few bytes",
    Firmware(rows=BOLT, check=_lax(_acts, Check.SHORT_ACCEPTED)),
)
_add(
    "setters check the lower bound, rvr",
    "as the first, on a robot whose drive has reads that are strict",
    Firmware(rows=RVR, check=_lax(_acts)),
    model="rvr",
)
_add(
    "drive ignores surplus",
    "only the commands of the drive ignore surplus bytes",
    Firmware(rows=BOLT, check=_lax(lambda row: row.did == 0x16 and _acts(row))),
)
_add(
    "legs ignore surplus",
    "only the animatronic commands ignore surplus bytes, though its reads do not",
    Firmware(rows=R2, check=_lax(lambda row: row.did == 0x17 and _acts(row))),
    model="r2d2",
)
_add(
    "legs ignore surplus, reads too",
    "every animatronic command ignores surplus bytes, its documented reads as well",
    Firmware(rows=R2, check=_lax(lambda row: row.did == 0x17)),
    model="r2d2",
)
_add(
    "power ignores surplus",
    "only what is not a read in the power device ignores surplus bytes, sleep among it",
    Firmware(rows=BOLT, check=_lax(lambda row: row.did == 0x13 and _acts(row))),
)
_add(
    "settings ignore surplus",
    "only the names and the configuration ignore surplus bytes",
    Firmware(rows=BOLT, check=_lax(lambda row: row.did in (0x11, 0x19) and _acts(row))),
)
_add(
    "some setters ignore surplus",
    "every third command that is not a read ignores surplus bytes",
    Firmware(rows=BOLT, check=_lax(lambda row: _acts(row) and row.cid % 3 == 0)),
)
_add(
    "the unknown ignore surplus",
    "whatever is documented is strict, whatever is not ignores surplus bytes",
    Firmware(rows=RVR, check=_lax(lambda row: not row.name)),
    model="rvr",
)
_add(
    "the unknown of the LEDs ignore surplus",
    "one unknown setter of one device ignores surplus bytes",
    Firmware(rows=BOLT, check=_lax(lambda row: not row.name and row.did == 0x1A)),
)
_add(
    "node 2 ignores surplus",
    "node 1 is strict, every command of node 2 ignores surplus bytes",
    Firmware(rows=BOLT, check=_lax(lambda row: row.node == 2)),
)
_add(
    "node 2 ignores surplus but for reads",
    "node 1 is strict; on node 2 the reads are, and nothing else",
    Firmware(rows=RVR, check=_lax(lambda row: row.node == 2 and _acts(row))),
    model="rvr",
)
_add(
    "all ignore surplus",
    "every command of every node ignores surplus bytes",
    Firmware(rows=BOLT, check=_lax(lambda _: True)),
)
_add(
    "length after running",
    "setters run first and then say that the length was wrong",
    Firmware(rows=BOLT, check=_lax(_acts, Check.AFTERWARDS)),
    expect=frozenset({Expect.BLIND}),
)
_add(
    "value before length",
    "a value out of range is refused before the length is looked at",
    Firmware(rows=BOLT, value_first=True),
    expect=_SURE,
)

# --- what cannot exist -------------------------------------------------------------------------------------


def _masks_in(*devices: int) -> Callable[[int, int, int], bool]:
    return lambda _, did, length: did in devices and length > 0


def _masks_long(_node: int, _did: int, length: int) -> bool:
    return length > 10


def _stubs(_node: int, _did: int) -> Word:
    return Code.STUB


def _yes(_node: int, _did: int) -> Word:
    return Code.SUCCESS


def _hush(_node: int, _did: int) -> Word:
    return Nothing.SAID


def _restricted(_node: int, _did: int) -> Word:
    return Code.RESTRICTED


def _all_restricted(moment: Moment) -> Word:
    return None if moment.request.did in (0x10, 0x11) or moment.pair == (0x13, 0x0D) else Code.RESTRICTED


def _stubs_in_leds(_node: int, did: int) -> Word:
    return Code.STUB if did == 0x1A else Code.NO_COMMAND


_add(
    "masks everywhere",
    "refuses a wrong length whether the command exists or not",
    Firmware(rows=BOLT, masks=_masks_long),
)
_add("masks in one device", "does so in the LEDs only", Firmware(rows=BOLT, masks=_masks_in(0x1A)))
_add(
    "masks in power",
    "does so in the power device only",
    Firmware(rows=RVR, masks=_masks_in(0x13)),
    model="rvr",
)
_add(
    "masks on node 2",
    "does so on node 2 only",
    Firmware(rows=BOLT, masks=lambda node, _, length: node == 2 and length > 0),
)
_add(
    "masks forty bytes",
    "refuses 40 bytes before it looks for the command, 11 after it",
    Firmware(rows=BOLT, masks=lambda _node, _did, length: length > 20),
)
_add("stubs", "says 0x03 of every command that cannot exist", Firmware(rows=BOLT, impossible=_stubs))
_add("stubs in one device", "does so in the LEDs only", Firmware(rows=BOLT, impossible=_stubs_in_leds))
_add(
    "the impossible exists",
    "has commands without arguments at ids where none should be, and they move, sleep and erase",
    (
        *BOLT,
        *(Row(1, did, cid, "", Effect.BRICK) for did in (0x11, 0x13, 0x1A) for cid in (0xFD, 0xFC, 0xFB)),
    ),
)
_add("yes-man", "says success to every command that cannot exist", Firmware(rows=BOLT, impossible=_yes))
_add("silent on the impossible", "answers what exists only", Firmware(rows=BOLT, impossible=_hush))
_add(
    "restricted",
    "says 0x04 of every command that cannot exist",
    Firmware(rows=RVR, impossible=_restricted),
    model="rvr",
)
_add(
    "all restricted",
    "says 0x04 of everything but its identity, whether it exists or not",
    Firmware(rows=BOLT, mood=_all_restricted),
    expect=_MEAGRE,
)
_add(
    "stubs for devices",
    "says 0x02 of devices that cannot exist, too",
    Firmware(rows=BOLT, no_device=Code.NO_COMMAND),
)

# --- answers that match no question ------------------------------------------------------------------------


def _from_node(node: int) -> Callable[[Answer, Moment], Answer]:
    return lambda answer, _: answer._replace(
        flags=answer.flags | 0x20, sid=(answer.sid or 0x10) & 0xF0 | node
    )


def _only_errors(answer: Answer, _: Moment) -> Answer | None:
    return answer if answer.code else None


_add(
    "another node answers",
    "every answer comes from node 5",
    BOLT,
    voice=Voice(alter=_from_node(5)),
    expect=_MUTE,
    oddity=r"node 5|source",
)
_add(
    "the wildcard answers",
    "every answer comes from node 0",
    BOLT,
    voice=Voice(alter=_from_node(0)),
    expect=frozenset({Expect.MUTE, Expect.TOLERABLE}),
    oddity=r"node 0|source|wildcard",
)
_add(
    "device 0 answers",
    "every answer names device 0",
    BOLT,
    voice=Voice(alter=lambda answer, _: answer._replace(did=0)),
    expect=_MUTE,
    oddity=r"device",
)
_add(
    "number 0 answers",
    "every answer has the sequence number 0",
    BOLT,
    voice=Voice(alter=lambda answer, _: answer._replace(seq=0)),
    expect=_MUTE,
    oddity=r"sequence|SEQ|seq",
)
_add(
    "the next number answers",
    "every answer has the sequence number of the request and one more",
    R2,
    model="r2d2",
    voice=Voice(alter=lambda answer, _: answer._replace(seq=(answer.seq + 1) & 0xFF)),
    expect=_MUTE,
    oddity=r"sequence|SEQ|seq",
)
_add(
    "flags of the request",
    "every answer repeats the request's flags, so that it does not say that it is one",
    BOLT,
    voice=Voice(
        alter=lambda answer, moment: answer._replace(
            flags=moment.request.flags, tid=moment.request.tid, sid=None
        )
    ),
    expect=_MUTE,
    oddity=r"flag",
)
_add(
    "only errors",
    "success is never answered",
    RVR,
    model="rvr",
    voice=Voice(alter=_only_errors),
    expect=_MUTE,
    oddity=r"error",
)

# --- late, lost, twice, out of order -----------------------------------------------------------------------


def _late_for(seconds: float, *pairs: tuple[int, int]) -> Voice:
    return Voice(late=lambda moment: seconds if moment.pair in pairs else 0.0)


for _seconds in (0.4, 0.6, 0.9, 3.0):
    _add(
        f"one command late by {_seconds} s",
        f"battery state, an unknown read and the last ids of the last device come {_seconds} s late",
        BOLT,
        voice=_late_for(_seconds, (0x13, 0x17), (0x13, 0x33), (0x18, 0x3F), (0x18, 0xFF)),
        expect=_SURE,
    )
_add(
    "everything late",
    "every answer takes 2 to 5 s",
    BOLT,
    voice=Voice(late=lambda moment: 2 + 3 * moment.robot.chance.random()),
    expect=_SURE,
    few=True,
)
_add(
    "the first answer is lost",
    "whatever is asked for the first time is not answered",
    BOLT,
    voice=Voice(alter=lambda answer, moment: None if moment.attempt == 1 else answer),
)
_add(
    "answers twice",
    "every answer comes twice",
    BOLT,
    voice=Voice(pieces=lambda frame, _: [frame, frame]),
    expect=_SURE,
)
_add(
    "answers out of order",
    "each answer takes up to 0.15 s more than the one before",
    BOLT,
    voice=Voice(late=lambda moment: 0.15 * moment.robot.chance.random()),
    expect=_SURE,
)
_add(
    "short queue",
    "loses what comes while three requests wait",
    BOLT,
    voice=Voice(queue=3, service=0.015),
    expect=_SURE,
)

# --- frames ------------------------------------------------------------------------------------------------


def _damages(moment: Moment) -> bool:
    """Some answers are damaged each time, and those to what does not exist as well."""
    return moment.pair in {(0x13, 0x17), (0x13, 0x33), (0x16, 0x1B)} or 0x39 <= moment.request.cid <= 0x3B


def _no_end(frame: bytes, moment: Moment) -> Sequence[bytes]:
    return [frame[:-1] if _damages(moment) else frame]


def _bad_sum(frame: bytes, moment: Moment) -> Sequence[bytes]:
    return [frame[:-2] + bytes([frame[-2] ^ 0x04]) + frame[-1:] if _damages(moment) else frame]


def _long_answers(size: int) -> tuple[Row, ...]:
    long = {(0x11, 0x06), (0x13, 0x33)}
    return tuple(row._replace(answer=bytes(size)) if row.pair in long else row for row in BOLT)


_add("no end byte", "some answers lack their last byte", BOLT, voice=Voice(pieces=_no_end), expect=_MEAGRE)
_add("bad checksum", "some answers have a bad checksum", BOLT, voice=Voice(pieces=_bad_sum), expect=_MEAGRE)
_add(
    "byte by byte",
    "answers arrive one byte at a time",
    BOLT,
    voice=Voice(pieces=lambda frame, _: [bytes([byte]) for byte in frame]),
    expect=_SURE,
)
_add("does not escape", "special bytes go out as they are", BOLT, voice=Voice(escape=False))
_add("2 kB answer", "two reads answer 2,048 bytes", _long_answers(2048))
_add("4 kB answer", "two reads answer 4,096 bytes", _long_answers(4096), expect=_MEAGRE)
_add("floods", "a thousand notifications a second", BOLT, voice=Voice(flood=1000), expect=_SURE)

# --- states ------------------------------------------------------------------------------------------------

_WAKE = (0x13, 0x0D)


def _node_2_sleeps(moment: Moment) -> Word:
    """Node 2 sleeps a second after it was last woken, and only node 1 can wake it."""
    return Code.UNAVAILABLE if moment.node == 2 and moment.now - moment.robot.woken_at > 1 else None


def _node_2_never(moment: Moment) -> Word:
    return Code.UNAVAILABLE if moment.node == 2 else None


def _node_2_dies(moment: Moment) -> Word:
    return Nothing.SAID if moment.node == 2 and moment.now > 3 else None


def _sleeps(moment: Moment) -> Word:
    """It falls asleep two seconds after it was woken, whatever it is asked."""
    if moment.now - moment.robot.woken_at > 2 and moment.pair != _WAKE:
        moment.robot.asleep = True
        return Nothing.SAID
    return None


def _busy_storms(moment: Moment) -> Word:
    return Code.BUSY if moment.now % 2 > 1.5 else None


def _mode(moment: Moment) -> Word:
    """After 150 requests it is in a mode in which everything is restricted."""
    return Code.RESTRICTED if moment.number > 150 else None


_add(
    "drops the line",
    "drops the line at every 97th request and starts again",
    BOLT,
    voice=Voice(drops=lambda moment: moment.number % 97 == 0),
)
_add(
    "one command restarts it",
    "an unknown command makes it drop the line and start again",
    BOLT,
    voice=Voice(drops=lambda moment: moment.pair == (0x13, 0x33)),
)
_add("falls asleep", "says nothing from 2 s after it was woken", Firmware(rows=BOLT, mood=_sleeps))
_add(
    "node 2 sleeps",
    "node 2 says 0x0A from 1 s after node 1 was last told to wake",
    Firmware(rows=RVR, mood=_node_2_sleeps),
    model="rvr",
)
_add(
    "node 2 never wakes",
    "node 2 says 0x0A to everything",
    Firmware(rows=BOLT, mood=_node_2_never),
    expect=frozenset({Expect.INCOMPLETE, Expect.MEAGRE}),
)
_add(
    "node 2 dies",
    "node 2 says nothing from 3 s on",
    Firmware(rows=RVR, mood=_node_2_dies),
    model="rvr",
    voice=Voice(latency=0.06),
    expect=frozenset({Expect.INCOMPLETE, Expect.MEAGRE}),
)
_add(
    "busy storms",
    "says busy to everything for half a second out of two",
    Firmware(rows=BOLT, mood=_busy_storms),
)
_add(
    "changes its mode",
    "says 0x04 to everything from the 150th request on",
    Firmware(rows=BOLT, mood=_mode),
    expect=frozenset({Expect.INCOMPLETE, Expect.MEAGRE}),
)

# --- what it claims ----------------------------------------------------------------------------------------


def _lies(rows: Sequence[Row], node: int) -> Claims:
    """Claims the unknown ids 3E and 3F everywhere, and a device that is not there."""
    return {did: [*cids, 0x3E, 0x3F] for did, cids in honest(rows, node).items()} | {0x2C: [0, 1]}


def _hides_commands(rows: Sequence[Row], node: int) -> Claims:
    return honest([row for row in rows if row.name], node)


def _hides_devices(rows: Sequence[Row], node: int) -> Claims:
    return {did: cids for did, cids in honest(rows, node).items() if did not in (0x13, 0x18)}


_COMPARED = _SURE | {Expect.COMPARED}
_add("claims ghosts", "claims more than it has", Firmware(rows=BOLT, claims=_lies), expect=_COMPARED)
_add(
    "hides commands",
    "claims the documented only",
    Firmware(rows=BOLT, claims=_hides_commands),
    expect=_COMPARED,
)
_add(
    "hides devices",
    "does not claim two of its devices",
    Firmware(rows=RVR, claims=_hides_devices),
    model="rvr",
    expect=_COMPARED,
)

# --- the older protocol ------------------------------------------------------------------------------------


def _v1_general(_: Moment) -> Word:
    return Code.FAILED


def _lost_when_long(answer: Answer, moment: Moment) -> Answer | None:
    """Answers to arguments of eleven bytes or more are lost the first two times."""
    return None if len(moment.request.data) >= 11 and moment.attempt <= 2 else answer


_V1 = Firmware(rows=BB8, older=True)
_add("plain bb-8", "strict everywhere, answers at once", _V1, model="bb8", expect=_SURE)
_add(
    "bb-8 says general error",
    "says general error to everything",
    Firmware(rows=BB8, older=True, mood=_v1_general),
    model="bb8",
    expect=_MEAGRE,
)
_add(
    "bb-8 loses calibration",
    "answers to long arguments are lost twice",
    _V1,
    model="bb8",
    voice=Voice(alter=_lost_when_long),
)
_add(
    "bb-8 floods",
    "a thousand asynchronous packets a second",
    _V1,
    model="bb8",
    voice=Voice(flood=1000),
    expect=_SURE,
)
_add(
    "bb-8 setters ignore surplus",
    "reads are strict, every other command ignores surplus bytes",
    Firmware(rows=BB8, older=True, check=_lax(_acts)),
    model="bb8",
)
