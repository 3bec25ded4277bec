"""What a client and its workers tell each other, and how it becomes bytes.

The bytes are pickles, like everything that Dask itself sends: anyone who reaches the scheduler can run code
in every worker and every client anyway.
"""

import pickle
from typing import Final, NamedTuple

from sphero_probe.fleet.action import Action
from sphero_probe.fleet.on_robot import RobotOptions
from sphero_probe.fleet.records import FleetRecord
from sphero_probe.fleet.robots import FleetRobot
from sphero_probe.session.addressing import address_of

PLACES: Final = "adapter"
"""The resource that limits how many robots a worker works on at a time."""
_ROBOT: Final = "robot:"


class Assignment(NamedTuple):
    """What a task is to do.

    Attributes:
        topic: where the client listens.
        client: the client's name in Dask.
        robot: the robot.
        action: what to do on it.
        options: how to connect, and what may be sent.
    """

    topic: str
    client: str
    robot: FleetRobot
    action: Action
    options: RobotOptions


class Hello(NamedTuple):
    """A worker begins to execute a task.

    Attributes:
        device: the robot.
        execution: a new name for each time that a task is executed.
        worker: the worker's address in Dask.
        host: the name of its host.
        inbox: where the worker listens.
    """

    device: str
    execution: str
    worker: str
    host: str
    inbox: str


class Begin(NamedTuple):
    """The answer to ``Hello``: connect, and run.

    Attributes:
        execution: which.
        place: the path of the client's journal, for messages; empty if there is none yet.
        journal: the lines that it holds, compressed with zlib.
    """

    execution: str
    place: str
    journal: bytes


class Grown(NamedTuple):
    """Something has happened on a robot.

    Attributes:
        device: the robot.
        execution: which.
        number: of this message within the execution, from 1.
        lines: new lines of the journal.
        records: new records.
        awaited: the worker waits for ``Written``.
    """

    device: str
    execution: str
    number: int
    lines: bytes
    records: tuple[FleetRecord, ...]
    awaited: bool


class Written(NamedTuple):
    """The lines of ``Grown`` messages are in the client's journal.

    Attributes:
        execution: which.
        number: of the last such message.
    """

    execution: str
    number: int


class Stop(NamedTuple):
    """End the run once nothing is in flight.

    Attributes:
        execution: which.
    """

    execution: str


class Leave(NamedTuple):
    """The client listens no more: end the run, and send nothing that would wait for the client.

    Attributes:
        execution: which.
    """

    execution: str


Upward = Hello | Grown
"""From a worker to the client."""
Downward = Begin | Written | Stop | Leave
"""From the client to a worker."""


def pack(message: Upward | Downward) -> bytes:
    """Return a message as bytes."""
    return pickle.dumps(message)


def unpack(data: bytes) -> Upward | Downward:
    """Return the message that these bytes are.

    Raises:
        TypeError: they are none, such as those of another version of the program.
    """
    try:
        message = pickle.loads(data)  # noqa: S301 - see the module's docstring
    except Exception as error:
        raise TypeError(f"not a message: {error}") from error
    if not isinstance(message, Hello | Grown | Begin | Written | Stop | Leave):
        raise TypeError(f"not a message: {type(message).__name__}")
    return message


def resource_of(device: str) -> str:
    """Return the Dask resource that stands for a robot: ``robot:BP-1234``, ``robot:fake:bolt``.

    Args:
        device: the robot's address, as ``--device`` takes it.

    Raises:
        UsageError: the address is not valid.
    """
    address = address_of(device)
    return _ROBOT + (address.rest.upper() if address.scheme == "ble" else str(address))


def device_of(resource: str) -> str:
    """Return the robot that a Dask resource stands for, empty if it stands for none."""
    return resource.removeprefix(_ROBOT) if resource.startswith(_ROBOT) else ""
