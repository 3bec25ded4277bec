"""Read a network of nodes, and the client's place in it, from JSON.

::

    {"systems": {"robot": {"nodes": [1, 2], "ports": {"1": 1}, "channels": [[1, 2]]},
                 "phone": {"nodes": [1], "ports": {"1": 1}}},
     "lines": [["phone:1", "robot:1"]],
     "client": "phone:1"}

``ports`` tells which node has a port, ``channels`` which nodes are joined, ``lines`` which ports of two
systems are. The robot is the system at the other end of the client's line.
"""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from sphero_probe.errors import BadInputFileError
from sphero_probe.simulator.network import Wiring
from sphero_probe.simulator.topology import Plug, System, Topology


def parse_topology(text: str, name: str) -> Wiring:
    """Read a network.

    Args:
        text: the JSON.
        name: of the file, for messages.

    Raises:
        BadInputFileError: it is no JSON, or no network; the message says why.
    """
    try:
        wiring = _wiring(json.loads(text))
    except (ValueError, RecursionError) as error:
        raise BadInputFileError(f"topology {name}: {error}") from error
    return wiring


def _wiring(document: object) -> Wiring:
    top = _fields(document, "a topology", {"systems", "lines", "client"})
    systems = top.get("systems")
    if not isinstance(systems, Mapping):
        raise ValueError('"systems" is an object: the name of each system, and what it has')  # noqa: TRY004
    lines = [(_plug(one), _plug(other)) for one, other in _pairs(top.get("lines", []), "lines")]
    topology = Topology({name: _system(name, value) for name, value in systems.items()}, lines)
    client = _plug(top.get("client"))
    if topology.behind(client) is None:
        raise ValueError(f'"client": no line is plugged in at "{client.system}:{client.port}"')
    return Wiring(topology, client)


def _system(name: str, value: object) -> System:
    fields = _fields(value, f"system {name}", {"nodes", "ports", "channels", "bad_target_from"})
    nodes, ports = fields.get("nodes"), fields.get("ports", {})
    if not (isinstance(nodes, list) and isinstance(ports, Mapping)):
        raise ValueError(f'system {name}: "nodes" is a list of numbers, "ports" an object')  # noqa: TRY004
    channels = [(_whole(a), _whole(b)) for a, b in _pairs(fields.get("channels", []), "channels")]
    answers = fields.get("bad_target_from")
    return System(
        tuple(map(_whole, nodes)),
        {_whole(port): _whole(node) for port, node in ports.items()},
        tuple(channels),
        None if answers is None else _whole(answers),
    )


def _fields(value: object, what: str, known: set[str]) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise ValueError(f"{what} is an object with {', '.join(sorted(known))}")  # noqa: TRY004 - of the file
    if unknown := sorted(value.keys() - known):
        raise ValueError(f"{what} has no {unknown[0]!r}; there are {', '.join(sorted(known))}")
    return value


def _pairs(value: object, what: str) -> Sequence[tuple[object, object]]:
    if not isinstance(value, list) or any(not isinstance(one, list) or len(one) != 2 for one in value):
        raise ValueError(f'"{what}" is a list of pairs')
    return [(one, other) for one, other in value]


def _plug(value: object) -> Plug:
    system, _, port = value.rpartition(":") if isinstance(value, str) else ("", "", "")
    if not system:
        raise ValueError('a port of a system is wanted, such as "robot:1"')
    return Plug(system, _whole(port))


def _whole(value: object) -> int:
    if isinstance(value, str) and value.isdecimal() and value.isascii() and len(value) <= 2:
        return int(value)
    if isinstance(value, int) and not isinstance(value, bool):
        return value
    raise ValueError(f"a whole number is wanted, not {value!r:.40}")
