"""What people paste from other tools decodes to its frames, in every usual form."""

import subprocess
from collections.abc import Callable
from contextlib import suppress
from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.captures.dumps import begins_as_dump
from sphero_probe.captures.pasted import pasted_bytes
from sphero_probe.captures.text import Logged, is_text, logged_packets
from sphero_probe.errors import UsageError
from sphero_probe.protocol import CODECS
from sphero_probe.protocol.packets import Malformed
from tests.support.capture_conversation import LONG, V1_FRAMES, V2_FRAMES

COMMAND, ANSWER = V2_FRAMES[0], V2_FRAMES[1]


def _signed(data: bytes) -> str:
    return str([byte - 256 if byte > 127 else byte for byte in data])


FORMS: Final[dict[str, Callable[[bytes], str]]] = {
    "dashes": lambda data: data.hex("-").upper(),
    "nRF Connect": lambda data: "(0x) " + data.hex("-").upper(),
    "colons": lambda data: data.hex(":"),
    "0x and one digit": lambda data: " ".join(map(hex, data)),
    "0x and commas": lambda data: ", ".join(f"0x{byte:02x}" for byte in data) + ",",
    "decimal list": lambda data: str(list(data)),
    "signed list": _signed,
    "hex list": lambda data: "[" + ", ".join(f"0x{byte:02x}" for byte in data) + "]",
    "C": lambda data: "{" + ", ".join(f"0x{byte:02X}" for byte in data) + "};",
    "bytes()": lambda data: f"bytes({list(data)})",
    "Uint8Array": lambda data: f"Uint8Array({len(data)}) [ {', '.join(map(str, data))} ]",
    "NSData": lambda data: f"<{data.hex(' ', -4)}>",
    "newer NSData": lambda data: f"{{length = {len(data)}, bytes = 0x{data.hex()}}}",
    "escapes": lambda data: "".join(f"\\x{byte:02x}" for byte in data),
    "quoted escapes": lambda data: '"' + "".join(f"\\x{byte:02x}" for byte in data) + '"',
    "Python": repr,
    "bytearray": lambda data: repr(bytearray(data)),
    "Node": lambda data: f"<Buffer {data.hex(' ')}>",
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    "data", [COMMAND, ANSWER, LONG, V1_FRAMES[0]], ids=["command", "answer", "long", "v1"]
)
def test_every_form_means_its_bytes(form: str, data: bytes) -> None:
    assert pasted_bytes(FORMS[form](data)) == data


@given(st.binary(min_size=1, max_size=40).map(lambda data: b"\x8d" + data), st.sampled_from(sorted(FORMS)))
def test_any_bytes_come_through_every_form(data: bytes, form: str) -> None:
    assert pasted_bytes(FORMS[form](data)) == data


@pytest.mark.parametrize("text", ["[10, 13, 16]", "[141, 300]", "0x8d 0x9 0x139"])
def test_what_may_mean_several_things_is_said(text: str) -> None:
    with pytest.raises(UsageError):
        pasted_bytes(text)


@pytest.mark.parametrize(
    "text", ["", "hello", "robot.bin", "[]", "[a, robot]", "8d-hello", "<html>", "C:\\x"]
)
def test_what_is_no_bytes_is_none(text: str) -> None:
    assert pasted_bytes(text) is None


@given(st.text(max_size=60))
def test_no_text_is_an_exception(text: str) -> None:
    with suppress(UsageError):
        pasted_bytes(text)
    list(logged_packets([text]))
    is_text(text.encode())


def read(text: str) -> list[Logged]:
    return list(logged_packets(text.splitlines()))


def frames(text: str) -> list[bytes]:
    return [CODECS[each.generation].frame_of(each.packet) for each in read(text)]


STREAM: Final = b"".join(V2_FRAMES)
DUMPS: Final = {
    "xxd": ("xxd",),
    "xxd by one": ("xxd", "-g1"),
    "xxd, eight": ("xxd", "-c", "8"),
    "hexdump -C": ("hexdump", "-v", "-C"),
    "od": ("od", "-v", "-t", "x1"),
    "od with text": ("od", "-v", "-t", "x1z"),
    "od, decimal": ("od", "-v", "-A", "d", "-t", "x1"),
}


@pytest.mark.unmeasured
@pytest.mark.parametrize("tool", DUMPS)
def test_dumps_by_the_real_tools(tool: str) -> None:
    try:
        ran = subprocess.run(DUMPS[tool], input=STREAM, capture_output=True, check=True)
    except FileNotFoundError:
        pytest.skip(f"{DUMPS[tool][0]} is not installed")
    assert begins_as_dump(ran.stdout)
    assert frames(ran.stdout.decode()) == V2_FRAMES


XXD: Final = """00000000: 8d3a 1201 1310 018e d88d 3901 1213 1001  .:........9.....
00000010: 0003 8cd8                                ..L.
"""


def test_a_dump_by_hand() -> None:
    assert begins_as_dump(XXD.encode())
    assert frames(XXD) == [COMMAND, ANSWER]
    assert not begins_as_dump(b"8d3a 1201")
    assert not begins_as_dump(b"00000000 8d3a")


def nrf(data: bytes) -> str:
    return data.hex("-").upper()


UUID: Final = "00010002-574f-4f20-5370-6865726f2121"
LOGS: Final = {
    "nRF Connect, Android": f"""nRF Connect, 2023-11-14
BP-0001 (C0:11:22:33:44:55)
V\t10:15:30.001\tConnecting to C0:11:22:33:44:55...
D\t10:15:30.002\tgatt = device.connectGatt(autoConnect = false, TRANSPORT_LE, preferred PHY = LE 1M)
V\t10:15:30.100\tWriting command to characteristic {UUID}
D\t10:15:30.101\tgatt.writeCharacteristic({UUID}, value=0x{COMMAND.hex().upper()})
I\t10:15:30.102\tData written to {UUID}, value: (0x) {nrf(COMMAND)}
A\t10:15:30.103\t"(0x) {nrf(COMMAND)}" sent
I\t10:15:30.166\tNotification received from {UUID}, value: (0x) {nrf(ANSWER)}
A\t10:15:30.166\t"(0x) {nrf(ANSWER)}" received
""",
    "nRF Connect, iOS": f"""[10:15:30.100] Writing value 0x{COMMAND.hex().upper()} to characteristic {UUID}
[10:15:30.100] peripheral.writeValue(0x{COMMAND.hex().upper()}, forCharacteristic: {UUID}, type: 1)
[10:15:30.166] [Callback] peripheral(didUpdateValueForCharacteristic: {UUID}, error: nil)
[10:15:30.166] Updated Value of Characteristic {UUID} to 0x{ANSWER.hex().upper()}.
[10:15:30.166] "0x{ANSWER.hex().upper()}" value received.
""",
    "LightBlue": f"""10:15:30.100 Wrote value {COMMAND.hex().upper()} to characteristic {UUID}
10:15:30.166 Characteristic ({UUID}) notified: <{ANSWER.hex()}>
""",
    "bluetoothctl": f"""[BP-0001:/service000b/char001b]# write {FORMS["0x and one digit"](COMMAND)}
Attempting to write /org/bluez/hci0/dev_C0_11_22_33_44_55/service000b/char001b
[CHG] Attribute /org/bluez/hci0/dev_C0_11_22_33_44_55/service000b/char001b Value:
  {ANSWER.hex(" ")}        .9..........
""",
    "btmon": f"""Bluetooth monitor ver 5.66
< ACL Data TX: Handle 64 flags 0x00 dlen 16                 #12 [hci0] 10.100000
      ATT: Write Command (0x52) len 11
        Handle: 0x001c Type: Vendor specific ({UUID})
          Data: {COMMAND.hex()}
> HCI Event: Number of Completed Packets (0x13) plen 5      #13 [hci0] 10.101000
        Num handles: 1
> ACL Data RX: Handle 64 flags 0x02 dlen 19                 #14 [hci0] 10.166000
      ATT: Handle Value Notification (0x1b) len 14
        Handle: 0x001c Type: Vendor specific ({UUID})
          Data[12]: {ANSWER.hex()}
""",
    "arrows": f"""connected to C0:11:22:33:44:55
-> {COMMAND.hex(" ")}
<- {ANSWER.hex(" ")}
""",
    "TX and RX": f"""2023-11-14 10:15:30,100 DEBUG ble TX: {COMMAND.hex(" ")}
2023-11-14 10:15:30,166 DEBUG ble RX: {ANSWER.hex(" ")}
""",
    "Python": f"""DEBUG:spherov2:write {UUID} {bytearray(COMMAND)!r}
DEBUG:spherov2:notification {UUID} {bytearray(ANSWER)!r}
""",
    "Go": f"""2023/11/14 10:15:30 sending packet {str(list(COMMAND)).replace(",", "")}
2023/11/14 10:15:30 received {str(list(ANSWER)).replace(",", "")}
""",
    "JavaScript": f"""> send <Buffer {COMMAND.hex(" ")}>
< response <Buffer {ANSWER.hex(" ")}>
""",
}


@pytest.mark.parametrize("tool", LOGS)
def test_a_log_is_read_once_with_directions(tool: str) -> None:
    said = read(LOGS[tool])
    assert frames(LOGS[tool]) == [COMMAND, ANSWER]
    assert [each.to_robot for each in said] == [True, False]
    if "10:15" in LOGS[tool]:
        assert "10:15:30" in str(said[0].time)


def test_a_frame_over_two_lines_with_another_between() -> None:
    text = f"RX: {LONG[:20].hex(' ')}\nTX: {COMMAND.hex(' ')}\nRX: {LONG[20:].hex(' ')}\n"
    assert frames(text) == [COMMAND, LONG]


def test_the_same_command_sent_twice_is_two() -> None:
    line = f"10:15:30.102 TX {COMMAND.hex(' ')}\n"
    assert frames(line + line) == [COMMAND, COMMAND]


def test_a_log_of_v1() -> None:
    arrows = ("->", "<-", "->", "<-", "<-")
    text = "".join(f"{arrow} {frame.hex(':')}\n" for arrow, frame in zip(arrows, V1_FRAMES, strict=True))
    assert frames(text) == V1_FRAMES
    assert [each.to_robot for each in read(text)] == [True, False, True, False, False]


def test_what_is_not_a_robots_is_passed_over() -> None:
    text = f"TX: 75 73 65 74 68 65\nRX: 01 02 03 04\nconnected to C0:11:22:33:44:55\nTX: {COMMAND.hex(' ')}\n"
    assert frames(text) == [COMMAND]


def test_half_a_frame_at_the_end_is_said() -> None:
    (only,) = read(f"RX: {LONG[:20].hex(' ')}\n")
    assert isinstance(only.packet, Malformed)
    assert only.packet.reason == "the text ends inside a frame"


@pytest.mark.parametrize(
    ("first", "expected"),
    [
        (b"hello\n", True),
        (b"\x8d\x0a\xd8", False),
        (b"\xff\xfe", False),
        (b"", False),
        ("→ 8d".encode(), True),
    ],
)
def test_text_is_told_from_bytes(first: bytes, expected: bool) -> None:
    assert is_text(first) is expected
