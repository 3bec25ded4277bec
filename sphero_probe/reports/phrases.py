"""Formats the values of rows as raw text for people.

Every function accepts whatever a row may hold, also from an untrusted file.
"""

import re
from collections.abc import Mapping
from functools import lru_cache

from sphero_probe.catalogue.provenance import ASSUMED, ONE_UNTESTED_SOURCE, UNTESTED
from sphero_probe.probing.finding import Outcome
from sphero_probe.reports.ids import spans

Data = Mapping[str, object]

_ID_FIELDS = frozenset(("did", "dids", "cid", "cids"))
_NOT_FOR_PEOPLE = re.compile(r"\{\w*\}|[!~]")
"""The names of a field's values, and the marks of an identifying or volatile one."""
_NEEDS_QUOTES = frozenset(' ,"')


def shown(value: object) -> str:
    """Return any value as text: nothing for null, yes and no, numbers with six digits, commas in lists."""
    if value is None:
        return ""
    if isinstance(value, str):
        return value
    match value:
        case bool():
            return "yes" if value else "no"
        case int():
            return str(value)
        case float():
            return f"{value:.6g}"
        case list() | tuple():
            return ", ".join(map(shown, value))
        case dict():
            return ", ".join(f"{key} {shown(held)}" for key, held in value.items())
        case _:
            return str(value)


def hex_id(value: object) -> str:
    """Return an id, a code or an address as ``0x13``, nothing for null."""
    return f"0x{value:02x}" if isinstance(value, int) else ""


def spaced_hex(value: object) -> str:
    """Return the bytes of a hex string as ``8d 0a 13``, nothing for null."""
    if not value or not isinstance(value, str):
        return ""
    try:
        return bytes.fromhex(value).hex(" ")
    except ValueError:  # from an untrusted file
        return " ".join(value[at : at + 2] for at in range(0, len(value), 2))


def pair(data: Data) -> str:
    """Return ``did`` and ``cid`` as ``0x13:0x10``, or the one that is known."""
    return ":".join(filter(None, (hex_id(data.get("did")), hex_id(data.get("cid")))))


def fields(data: Data) -> str:
    """Return the decoded ``fields`` with their ``units``: ``percentage 87 %, state ok``."""
    values, units = data.get("fields"), data.get("units")
    if not isinstance(values, dict):
        return ""
    payload = data.get("payload")
    held = payload if isinstance(payload, str) else ""
    texts = [(name, _field_value(name, value, held)) for name, value in values.items()]
    if not units or not isinstance(units, dict):  # most packets of a stream
        return ", ".join([f"{name} {text}" if name and text else name or text for name, text in texts])
    return ", ".join([" ".join(filter(None, (name, text, shown(units.get(name))))) for name, text in texts])


@lru_cache(maxsize=64)
def _six_digits(count: int) -> str:
    return " ".join(["%.6g"] * count)


def _field_value(name: str, value: object, payload: str) -> str:
    if isinstance(value, list):
        if value and {*map(type, value)} == {float}:
            return _six_digits(len(value)) % tuple(value)
        if name in _ID_FIELDS and value == sorted({one for one in value if isinstance(one, int)}):
            value = spans(value)
        return " ".join(_field_value(name, one, payload) for one in value) or "none"
    if name in _ID_FIELDS and isinstance(value, int):
        return hex_id(value)
    if isinstance(value, str):
        if _is_part(value, payload):
            return spaced_hex(value)
        if not value or _NEEDS_QUOTES.intersection(value):
            return f'"{value}"'
    return shown(value)


def _is_part(text: str, payload: str) -> bool:
    """Whether a text is bytes of the payload in hex: a field of bytes looks like one of text otherwise."""
    return (
        bool(text)
        and len(text) % 2 == 0
        and text in {payload[at : at + len(text)] for at in range(0, len(payload), 2)}
    )


def outcome(data: Data) -> str:
    """Return how a probe ended: the answer, or that there was none."""
    attempts = data.get("attempts")
    if data.get("outcome") == "sent":
        return shown(data.get("note"))
    if data.get("code") is not None:
        return answer(data)
    return f"no answer, asked {attempts} times" if isinstance(attempts, int) and attempts > 1 else "no answer"


def arguments(data: Data) -> str:
    """Return with what a command was sent: ``did 0x13``; empty where no layout of the catalogue fits."""
    return fields({"fields": data.get("arguments"), "payload": data.get("request")})


def content(data: Data) -> str:
    """Return the payload: LEDs and fields if they are known, its bytes otherwise."""
    if not data.get("payload") and not data.get("fields") and not data.get("leds"):
        return ""
    return leds(data) or fields(data) or spaced_hex(data.get("payload"))


def leds(data: Data) -> str:
    """Return the LEDs that a command sets: ``front ff0000, back 0000ff``; empty for other packets."""
    return shown(data.get("leds"))


def answer(data: Data) -> str:
    """Return an answer: ``success: percentage 87 %``, ``bad data length``, ``0x2a unlisted: 01 02``."""
    name = shown(data.get("code_name"))
    if name in ("", "unlisted"):
        name = f"{hex_id(data.get('code'))} {name}".strip()
    return ": ".join(filter(None, (name, content(data))))


def packet(data: Data) -> str:
    """Return a packet in words: its code and content, or what is wrong with it and its bytes."""
    if data.get("kind") == "malformed":
        return f"{shown(data.get('reason'))}: {spaced_hex(data.get('raw'))}"
    doubt = data.get("doubt")
    return remarked(remarked(answer(data), data.get("note")), f"doubtful: {doubt}" if doubt else None)


def note(data: Data) -> str:
    """Return a note in one line: its text and its content."""
    says = content(data) or spaced_hex(data.get("raw"))
    return f"{shown(data.get('text'))}: {says}" if says else shown(data.get("text"))


def remarked(text: str, remark: object) -> str:
    """Return the text with a remark in brackets, if there is one."""
    return f"{text} ({remark})".lstrip() if remark else text


def robots(value: object) -> str:
    """Return the robots of a command with their nodes: ``bolt:1,2 mini:1``."""
    if not isinstance(value, dict):
        return shown(value)
    return " ".join(
        f"{key}:{','.join(map(str, nodes))}" if isinstance(nodes, list) and nodes else str(key)
        for key, nodes in value.items()
    )


def weak_provenance(data: Data) -> str:
    """Return the robots that no tested source names: ``bolt-plus: reported by one untested source``."""
    sources = data.get("provenance")
    weak: dict[str, list[str]] = {}
    for key, names in sources.items() if isinstance(sources, dict) else ():
        words = {shown(name) for name in names} if isinstance(names, list) else set()
        if words and words <= UNTESTED:
            weak.setdefault(ONE_UNTESTED_SOURCE, []).append(shown(key))
        elif words == {"assumed"}:
            weak.setdefault(ASSUMED, []).append(shown(key))
    return "; ".join(f"{' '.join(keys)}: {why}" for why, keys in weak.items())


def firmware(data: Data) -> str:
    """Return on which firmware a command was reported: ``rvr 8.3.432: answers (source)``."""
    seen = data.get("firmware")
    return "; ".join(
        f"{shown(one.get('robot'))} {shown(one.get('firmware'))}: "
        f"{'answers' if one.get('exists') else 'no such command'} ({shown(one.get('source'))})"
        for one in (seen if isinstance(seen, list) else ())
        if isinstance(one, dict)
    )


def sightings(value: object) -> str:
    """Return the same for scripts, one word each: ``rvr@8.3.432:1=exists``."""
    return " ".join(
        f"{shown(one.get('robot'))}@{shown(one.get('firmware'))}"
        f"{':' + shown(one.get('node')) if one.get('node') is not None else ''}"
        f"={'exists' if one.get('exists') else 'absent'}"
        for one in (value if isinstance(value, list) else ())
        if isinstance(one, dict)
    )


def provenance(value: object) -> str:
    """Return the sources per robot for scripts: ``bolt:spherov2 bolt-plus:reference,unsw``."""
    return " ".join(
        f"{shown(key)}:{','.join(map(shown, names if isinstance(names, list) else []))}"
        for key, names in (value.items() if isinstance(value, dict) else ())
    )


def catalogue_remark(data: Data) -> str:
    """Return why a command may be missing: firmware without it, an untested source."""
    seen = data.get("firmware")
    lacks = [
        f"{shown(one.get('robot'))} {shown(one.get('firmware'))}"
        for one in (seen if isinstance(seen, list) else ())
        if isinstance(one, dict) and not one.get("exists")
    ]
    sources = data.get("provenance")
    untested = [
        shown(key)
        for key, names in (sources.items() if isinstance(sources, dict) else ())
        if isinstance(names, list) and names and UNTESTED.issuperset(map(shown, names))
    ]
    words = [f"absent on {', '.join(lacks)}"] if lacks else []
    words += [f"{' '.join(untested)} {ONE_UNTESTED_SOURCE}"] if untested else []
    return "; ".join(words)


def channels(data: Data) -> str:
    """Return the channels of a lamp with their bits: ``red 0, green 1, blue 2``."""
    return shown(data.get("channels"))


def switch(data: Data) -> str:
    """Return the command that enables a notification, and the first firmware that has it."""
    words = [shown(data.get("enabled_by"))]
    if since := shown(data.get("since")):
        words.append(f"firmware {since} or later")
    return ", ".join(filter(None, words))


def layout(value: object) -> str:
    """Return the layout of a payload for people: ``unknown``, or ``nothing`` for no bytes."""
    return "unknown" if value is None else _NOT_FOR_PEOPLE.sub("", shown(value)) or "nothing"


def layout_record(value: object) -> str:
    """Return the layout of a payload for scripts: empty where unknown, ``nothing`` for no bytes."""
    return "" if value is None else shown(value) or "nothing"


def exchanged(data: Data) -> str:
    """Return both layouts of a command in a phrase: ``efuse_id:u8 -> status:u8``."""
    takes, gives = layout(data.get("request")), layout(data.get("response"))
    if data.get("kind") == "notification":
        return f"-> {gives}"
    return takes if takes == gives == "unknown" else f"{takes} -> {gives}"


def role(data: Data) -> str:
    """Return the risk class of a command, or ``notification``."""
    return "notification" if data.get("kind") == "notification" else shown(data.get("risk"))


def measured(data: Data) -> str:
    """Return a ``value`` with its ``unit``."""
    return f"{shown(data.get('value'))} {shown(data.get('unit'))}".strip()


def counted_outcome(word: str) -> str:
    """Return an outcome as it reads after a number: ``exist``, ``blocked`` for ``skipped``."""
    return {Outcome.EXISTS.value: "exist", Outcome.SKIPPED.value: "blocked"}.get(word, word)


def found(data: Data) -> str:
    """Return the outcomes of a run, without zeros: ``8 exist, 239 absent``."""
    counts = data.get("counts")
    held = counts.items() if isinstance(counts, dict) else ()
    return ", ".join(f"{shown(count)} {counted_outcome(shown(word))}" for word, count in held if count)


def end_of_run(data: Data) -> str:
    """Return how the run of a journal ended, or what is wrong with the journal."""
    if problem := shown(data.get("problem")):
        return f"broken: {problem.replace(shown(data.get('file')), '').lstrip(': ')}"
    return "complete" if data.get("complete") else "incomplete"
