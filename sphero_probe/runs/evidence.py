"""Write evidence files: what an evidence run found, as redacted JSON.

Nothing in a file names a robot or its owner. The data of an answer is written only where the catalogue knows
its layout, and no field of it identifies a robot. Other data is replaced by its length and a digest. The key
of the digests is random and not written.
"""

import json
import re
import secrets
from collections.abc import Collection, Iterator
from hashlib import blake2b
from typing import Final

from sphero_probe.catalogue import rows_of
from sphero_probe.probing.evidence import Asked, Evidence, Replaced
from sphero_probe.protocol.packets import Command, Generation

TYPE: Final = "evidence"
SCHEMA_VERSION: Final = 1
DIGEST_BYTES: Final = 6
_KEY_BYTES: Final = 32
_SHORTEST: Final = 4
"""Bytes of an identifier from which on it is searched for; a shorter one is found everywhere by chance."""
_HARDWARE: Final = re.compile(r"[0-9A-Fa-f]{2}(?:[:-][0-9A-Fa-f]{2}){5}")


def redact_once(evidence: Evidence, identifiers: Collection[str]) -> Evidence:
    """Return the evidence redacted with a random key, which is kept nowhere.

    Args:
        evidence: as it was collected.
        identifiers: as ``redact`` takes them.
    """
    return redact(evidence, identifiers, secrets.token_bytes(_KEY_BYTES))


def redact(evidence: Evidence, identifiers: Collection[str], key: bytes) -> Evidence:
    """Return the evidence with all data replaced that may identify a robot or its owner.

    Args:
        evidence: as it was collected.
        identifiers: texts that must not appear: the robot's name and its addresses.
        key: of the digests, up to 64 random bytes; it is not in the result.
    """
    forms = frozenset(form for text in identifiers for form in _forms(text))
    generation = evidence.generation

    def shared(asked: Asked) -> Asked:
        data = asked.data
        if isinstance(data, Replaced) or not data or _is_public(generation, asked.command, data, forms):
            return asked
        digest = blake2b(data, key=key, digest_size=DIGEST_BYTES).hexdigest()
        return asked._replace(data=Replaced(len(data), digest))

    return evidence._replace(asked=tuple(map(shared, evidence.asked)))


def _is_public(generation: Generation, command: Command, data: bytes, forms: Collection[bytes]) -> bool:
    """Whether an answer has a known layout without identifying fields, and holds no identifier."""
    layouts = [row.response for row in rows_of(generation, command.did, command.cid) if row.response]
    if not any(not layout.decode(data).problem for layout in layouts):
        return False
    if any(layout.identifying_spans(data) for layout in layouts):
        return False
    lowered = data.lower()
    return not any(form in lowered for form in forms)


def _forms(text: str) -> Iterator[bytes]:
    """Yield how an identifier may appear in bytes: as text and in hex, whole and in part, also backwards."""
    whole = text.encode("utf-8", "surrogatepass")
    parts = [whole, *whole.split(b"-")]
    for found in _HARDWARE.findall(text):
        raw = bytes.fromhex(re.sub("[:-]", "", found))
        parts += [raw, *(raw.hex(*by).encode() for by in ((), (":",), ("-",)))]
    for part in parts:
        if len(part) >= _SHORTEST:
            for form in (part.lower(), part.hex().encode()):
                yield form
                yield form[::-1]


def encode(evidence: Evidence) -> str:
    """Return redacted evidence as JSON text in ASCII, with one line for each command."""
    lines = [f'"{key}": {_value(value)}' for key, value in _document(evidence).items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _value(value: object) -> str:
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return "[\n" + ",\n".join(f"  {json.dumps(one)}" for one in value) + "\n]"
    return json.dumps(value)


def _document(evidence: Evidence) -> dict[str, object]:
    idle = evidence.idle
    return {
        "type": TYPE,
        "schema_version": SCHEMA_VERSION,
        **evidence._asdict(),
        "firmware": dict(evidence.firmware),
        "chunks": {str(size): count for size, count in evidence.chunks.items()},
        "nodes": [node._asdict() for node in evidence.nodes],
        "asked": [_asked(one) for one in evidence.asked],
        "bursts": [burst._asdict() for burst in evidence.bursts],
        "idle": idle and {**idle._asdict(), "heard": [heard._asdict() for heard in idle.heard]},
        "surprises": [_command(command) for command in evidence.surprises],
        "seconds": round(evidence.seconds, 1),
    }


def _command(command: Command) -> dict[str, object]:
    did, cid, payload, target, _ = command
    return {"target": target, "did": did, "cid": cid, "payload": payload.hex()}


def _asked(asked: Asked) -> dict[str, object]:
    data = asked.data
    return {
        "topic": asked.topic.value,
        **_command(asked.command),
        "flags": asked.flags,
        "ending": asked.ending.value,
        "code": asked.code,
        "data": data._asdict() if isinstance(data, Replaced) else data.hex(),
        "source": asked.source,
        "client": asked.client,
        "milliseconds": asked.milliseconds,
    }
