"""Addresses, compared with Sphero's description of its API and captured bytes; one module splits the byte."""

import ast
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.protocol.address import PRIMARY, WILDCARD, Address

PACKAGE = Path(__file__).resolve().parents[2] / "sphero_probe"
HOME = PACKAGE / "protocol" / "address.py"
NIBBLES = st.integers(0, 15)


@pytest.mark.parametrize(
    ("byte", "address"),
    [
        pytest.param(0x01, Address(0, 1), id="the client itself, as every library sends it"),
        pytest.param(0x11, Address(1, 1), id="primary node over Bluetooth, as spherov2 sends it"),
        pytest.param(0x12, Address(1, 2), id="secondary node over Bluetooth"),
        pytest.param(0x21, Address(2, 1), id="the client as an RVR behind its UART sees it, captured"),
        pytest.param(0x2A, Address(2, 0xA), id="2a of the worked example in the description"),
        pytest.param(0x10, Address(1, WILDCARD), id="any node behind port 1"),
    ],
)
def test_a_byte_is_port_and_node(byte: int, address: Address) -> None:
    assert Address.from_byte(byte) == address
    assert address.byte == byte
    assert address.is_wildcard == (address.node == 0)


@given(NIBBLES, NIBBLES, NIBBLES)
def test_another_node_behind_the_same_port(port: int, node: int, other: int) -> None:
    moved = Address(port, node).with_node(other)
    assert moved == (port, other)
    assert divmod(moved.byte, 16) == (port, other)


@given(st.integers(0, 255))
def test_every_byte_is_an_address(byte: int) -> None:
    assert Address.from_byte(byte).byte == byte


@pytest.mark.parametrize("byte", [-1, 256, 0x111])
def test_a_number_that_is_not_a_byte_is_not_an_address(byte: int) -> None:
    with pytest.raises(ValueError, match="not an address byte"):
        Address.from_byte(byte)


@pytest.mark.parametrize("address", [Address(16, PRIMARY), Address(0, 16), Address(-1, 1), Address(1, -1)])
def test_what_does_not_fit_has_no_byte(address: Address) -> None:
    with pytest.raises(ValueError, match="0 to 15"):
        _ = address.byte


def nibble_arithmetic(source: str) -> list[str]:
    """Expressions in a module that shift by four bits or mask a nibble."""
    tree = ast.parse(source)
    constants = {
        target.id: node.value.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign | ast.AnnAssign) and isinstance(node.value, ast.Constant)
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        if isinstance(target, ast.Name)
    }

    def value(node: ast.expr) -> object:
        if isinstance(node, ast.Name):
            return constants.get(node.id)
        return node.value if isinstance(node, ast.Constant) else None

    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp):
            operator, left, right = node.op, node.left, node.right
        elif isinstance(node, ast.AugAssign):
            operator, left, right = node.op, node.target, node.value
        else:
            continue
        shifts = isinstance(operator, ast.LShift | ast.RShift) and value(right) == 4
        masks = isinstance(operator, ast.BitAnd) and {value(left), value(right)} & {0x0F, 0xF0}
        divides = isinstance(operator, ast.Mult | ast.FloorDiv | ast.Mod) and value(right) == 16
        if shifts or masks or divides:
            found.append(ast.unparse(node))
    return found


NO_ADDRESS = {"body[4] & _PDU_TYPE"}
"""Four bits of something else: the type of a Bluetooth advertisement."""


def test_nibble_arithmetic_is_found() -> None:
    source = "_NODE: int = 0x0F\nx = port << 4 | 1\ny = target & 0xF0\nz = byte >> 4\n"
    source += "n = _NODE & b\nb >>= 4\np = b // 16"
    assert len(nibble_arithmetic(source)) == 6
    assert nibble_arithmetic("a = b << 8 | c\nd = e & 0xFF\nf = 1 << 40\ng = 16 * h") == []


@pytest.mark.parametrize(
    "file",
    [pytest.param(file, id=str(file.relative_to(PACKAGE))) for file in sorted(PACKAGE.rglob("*.py"))],
)
def test_only_one_module_splits_address_bytes(file: Path) -> None:
    found = [one for one in nibble_arithmetic(file.read_text(encoding="utf-8")) if one not in NO_ADDRESS]
    assert bool(found) == (file == HOME), found
