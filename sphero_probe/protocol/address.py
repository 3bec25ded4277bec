"""Node addresses: a port and a node number, which share one byte on the wire.

From "Sending Information via Channels" in Sphero's description of its API [vendor]: an address is seen from
the sender. The port is the one through which a packet leaves the sender's system, 0 for a node of the same
system. Node 0 is the wildcard: the receiving system decides which of its nodes serves the command. The byte
is port << 4 | node [reference, real]; in this package, only this module splits it.
"""

from typing import Final, NamedTuple, Self

WILDCARD: Final = 0
"""The node number that stands for any node that can serve a command."""
PRIMARY: Final = 1
"""The number of a robot's usual node; every robot that takes addresses has it."""

_NODE_BITS: Final = 4
_NODE_MASK: Final = (1 << _NODE_BITS) - 1


def node_of(byte: int | None) -> int:
    """Return the node number in an address byte, the wildcard where there is no address."""
    return WILDCARD if byte is None else byte & _NODE_MASK


class Address(NamedTuple):
    """One node as a packet names it.

    Attributes:
        port: the port that leads to the node, 0-15; 0 is the sender's own system.
        node: the node's number, 0-15; 0 is the wildcard.
    """

    port: int
    node: int

    @classmethod
    def from_byte(cls, byte: int) -> Self:
        """Return the address that a byte encodes.

        Raises:
            ValueError: it is not a byte.
        """
        if not 0 <= byte <= 0xFF:
            raise ValueError(f"{byte} is not an address byte")
        return cls(byte >> _NODE_BITS, byte & _NODE_MASK)

    @property
    def byte(self) -> int:
        """The address on the wire, 0-255.

        Raises:
            ValueError: the port or the node does not fit.
        """
        if not (0 <= self.port <= _NODE_MASK and 0 <= self.node <= _NODE_MASK):
            raise ValueError(
                f"port {self.port}, node {self.node}: an address holds 0 to {_NODE_MASK} of each"
            )
        return self.port << _NODE_BITS | self.node

    @property
    def is_wildcard(self) -> bool:
        """Whether any node behind the port may answer."""
        return self.node == WILDCARD

    def with_node(self, node: int) -> Self:
        """Return the address of another node behind the same port."""
        return self._replace(node=node)
