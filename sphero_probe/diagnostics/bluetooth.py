"""Checks this machine's Bluetooth, from D-Bus up to a short scan.

A check that depends on a failed one is skipped, so that the cause stands out.
"""

import os
import platform
from collections.abc import Iterable
from typing import Final

from sphero_probe.catalogue import robot_by_prefix
from sphero_probe.diagnostics.machine import surroundings, within
from sphero_probe.errors import SpheroProbeError
from sphero_probe.reports.checks import Look, State, Tell
from sphero_probe.reports.rows import UNKNOWN_SPHERO
from sphero_probe.transports.base import WHY_UNHEARD, OpenOptions, Seen
from sphero_probe.transports.ble import machine
from sphero_probe.transports.ble.explain import step
from sphero_probe.transports.ble.wording import OLDEST_BLUEZ, SWITCH_ON
from sphero_probe.transports.registry import scan

LISTENING: Final = 1.0
"""Seconds of the scan: enough to see that scanning is allowed, and to hear most robots nearby."""

_NAMED: Final = 5
_GROUP: Final = "bluetooth"

BUS, VERSION, SERVICE = "D-Bus", "BlueZ version", "BlueZ"
ADAPTERS, SWITCHES, POWER, ROLE = "adapter", "radio switch", "power", "Bluetooth LE"
CONNECTED, SCAN = "robots in use", "scan"

_INSIDE: Final = {
    "a container": "share the host's D-Bus: docker run -v /run/dbus:/run/dbus IMAGE; or run on the host",
    "WSL": "WSL has no Bluetooth of its own: run it in Windows, or attach a USB adapter with usbipd",
}


async def check_bluetooth(tell: Tell, timeout: float, adapter: str) -> bool:
    """Check Bluetooth; problems are reported to ``tell``, not raised. Return whether a scan is possible.

    Args:
        tell: takes each result.
        timeout: seconds for each check.
        adapter: the adapter to use, empty for any.
    """
    broken = ""
    if on_linux():
        reached = await _check_bus(tell, timeout)
        tell(VERSION, await _version(timeout))
        sight = await _check_service(tell, timeout) if reached else None
        if sight is None:
            reason = f"{SERVICE} does not answer" if reached else f"no {BUS}"
            _skip(tell, (ADAPTERS,) if reached else (SERVICE, ADAPTERS), reason)
            tell(SWITCHES, _switches(machine.switches(), hinders=False))
            _skip(tell, (POWER, ROLE, CONNECTED, SCAN), reason)
            return False
        broken = _check_adapters(tell, sight, adapter)
    if broken:
        _skip(tell, (SCAN,), broken)
        return False
    scanned = await _scan(timeout, adapter)
    tell(SCAN, scanned)
    return scanned.state is State.OK


def on_linux() -> bool:
    """Whether this system uses BlueZ."""
    return platform.system() == "Linux"


def _skip(tell: Tell, names: Iterable[str], reason: str) -> None:
    for name in names:
        tell(name, Look(State.SKIPPED, reason))


async def _check_bus(tell: Tell, timeout: float) -> bool:
    address = os.environ.get("DBUS_SYSTEM_BUS_ADDRESS", "")
    where = f" (DBUS_SYSTEM_BUS_ADDRESS={address})" if address else ""
    try:
        async with step("scan", timeout + machine.CLOSING):
            await machine.reach_bus(timeout)
    except SpheroProbeError as error:
        if isinstance(error.__cause__, TimeoutError):
            look = Look(
                State.FAIL,
                f"the system bus does not answer within {timeout:g} s{where}",
                "restart it (systemctl restart dbus) or the machine",
            )
        else:
            absent = isinstance(error.__cause__, FileNotFoundError | ConnectionRefusedError)
            fix = _INSIDE.get(surroundings(), "") if absent else _fix_for_denied(error)
            look = Look(State.FAIL, f"{error}{where}", fix or error.hint)
        tell(BUS, look)
        return False
    tell(BUS, Look(State.OK, "the system bus answers"))
    return True


async def _version(timeout: float) -> Look:
    found = await machine.bluez_version(timeout)
    if not found:
        return Look(State.SKIPPED, "unknown: bluetoothctl is not installed")
    if within(found, f">={OLDEST_BLUEZ}"):
        return Look(State.OK, found)
    return Look(State.FAIL, f"{found}, but {OLDEST_BLUEZ} or later is needed", "install a newer BlueZ")


async def _check_service(tell: Tell, timeout: float) -> machine.Sight | None:
    try:
        async with step("scan", timeout + machine.CLOSING):
            sight = await machine.look(timeout)
    except SpheroProbeError as error:
        if isinstance(error.__cause__, TimeoutError):
            said = f"the Bluetooth service does not answer within {timeout:g} s"
        else:
            said = str(error)
        tell(SERVICE, Look(State.FAIL, said, _fix_for_denied(error) or error.hint))
        return None
    tell(SERVICE, Look(State.OK, "the Bluetooth service answers"))
    return sight


def _fix_for_denied(error: SpheroProbeError) -> str:
    """Return the fix for a user who was denied access, by group membership; empty for other errors."""
    cause = error.__cause__
    name = str(cause.args[0]) if cause and cause.args else ""
    denied = isinstance(cause, PermissionError) or "AccessDenied" in name
    if not denied or not on_linux():
        return ""
    user, member, active = membership()
    if active:
        return f"{user} is in the group {_GROUP} already: check the D-Bus policy of BlueZ"
    if member:
        return f"log out and in again: {user} is in the group {_GROUP}, but not yet in this session"
    return f"sudo usermod -aG {_GROUP} {user}, then log out and in again"


def membership() -> tuple[str, bool, bool]:
    """Return the user's name, and whether the user and this session are in the group for Bluetooth."""
    import grp  # noqa: PLC0415 - there is none on Windows
    import pwd  # noqa: PLC0415

    try:
        user = pwd.getpwuid(os.getuid()).pw_name
    except KeyError:
        user = f"user {os.getuid()}"
    try:
        group = grp.getgrnam(_GROUP)
    except KeyError:
        return user, False, False
    return user, user in group.gr_mem, group.gr_gid in os.getgroups()


def _check_adapters(tell: Tell, sight: machine.Sight, wanted: str) -> str:
    """Report the adapters; return what prevents a scan, empty if nothing does."""
    there = sight.adapters
    usable = [one for one in there if not wanted or one.name == wanted]
    names = ", ".join(f"{one.name} {one.address}" for one in there)
    powered = [one for one in usable if one.powered]
    if not usable:
        seen = f"no adapter {wanted}; found: {names}" if there else "none"
        fix = (
            f"use one of them: --adapter {there[0].name}"
            if there
            else "plug in an adapter, and check that its driver is loaded"
        )
        fix = fix if there or not surroundings() else _INSIDE[surroundings()]
        tell(ADAPTERS, Look(State.FAIL, seen, fix))
        tell(SWITCHES, _switches(machine.switches(), hinders=False))
        broken = f"no adapter {wanted}".rstrip()
        _skip(tell, (POWER, ROLE), broken)
    else:
        several = len(powered) > 1
        fix = f"any of them may be used; choose one with --adapter {powered[0].name}" if several else ""
        tell(ADAPTERS, Look(State.WARN if several else State.OK, names, fix))
        tell(SWITCHES, _switches(machine.switches(), hinders=not powered))
        tell(POWER, _power(usable, powered))
        tell(ROLE, _role(usable, powered))
        able = any(one.central for one in powered)
        broken = (
            ("" if able else "the adapter does not support Bluetooth LE") if powered else "the adapter is off"
        )
    tell(CONNECTED, _connected(sight.connected))
    return broken


def _power(usable: list[machine.Adapter], powered: list[machine.Adapter]) -> Look:
    seen = ", ".join(f"{one.name} is {'on' if one.powered else 'off'}" for one in usable)
    if powered:
        return Look(State.OK, seen)
    return Look(State.FAIL, seen, SWITCH_ON["linux"])


def _role(usable: list[machine.Adapter], powered: list[machine.Adapter]) -> Look:
    """Check for the role that scans and connects, among the adapters that are on, if any."""
    looked_at = powered or usable
    able = [one.name for one in looked_at if one.central]
    unable = ", ".join(one.name for one in looked_at if not one.central)
    if not able:
        asleep = [one for one in usable if one.central]
        fix = "plug in an adapter for Bluetooth LE"
        if asleep:
            fix = f"switch on {asleep[0].name}, which can: bluetoothctl select {asleep[0].address}, power on"
        return Look(State.FAIL, f"{unable} cannot connect to robots (no central role)", fix)
    if unable:
        seen = f"{', '.join(able)} can connect to robots, {unable} cannot"
        return Look(State.WARN, seen, f"use --adapter {able[0]}")
    return Look(State.OK, f"{', '.join(able)} can connect to robots (central role)")


def _switches(found: list[machine.Switch], *, hinders: bool) -> Look:
    hard = ", ".join(one.name for one in found if one.hard)
    soft = ", ".join(one.name for one in found if one.soft and not one.hard)
    state = State.FAIL if hinders else State.WARN
    if hard:
        return Look(state, f"{hard} is blocked", "use the machine's radio switch or key")
    if soft:
        return Look(state, f"{soft} is blocked", "rfkill unblock bluetooth")
    if not found:
        return Look(State.SKIPPED, "this system reports none")
    return Look(State.OK, f"{', '.join(one.name for one in found)} not blocked")


def _connected(peers: list[machine.Peer]) -> Look:
    robots = [peer for peer in peers if robot_by_prefix(peer.name)]
    if not robots:
        return Look(State.OK, "no robot is connected to this machine")
    seen = ", ".join(f"{peer.name} {peer.address}" for peer in robots)
    fix = f"no scan finds it: close the program that uses it, or bluetoothctl disconnect {robots[0].address}"
    return Look(State.WARN, f"{seen} is connected to this machine", fix)


async def _scan(timeout: float, adapter: str) -> Look:
    """Scan for a moment: missing permissions show here."""
    try:
        async with step("scan", timeout + LISTENING):
            seen = await scan(OpenOptions(LISTENING, adapter), everything=True)
    except SpheroProbeError as error:
        return Look(State.FAIL, str(error), _fix_for_denied(error) or error.hint)
    heard = [one for one in seen if not one.connected]
    robots = [_robot(one) for one in heard if one.is_sphero]
    devices = f"{len(heard)} device{'' if len(heard) == 1 else 's'}"
    said = f"works; heard {devices} in {LISTENING:g} s"
    if not robots:
        return Look(State.OK, f"{said}, no robot", f"if a robot is nearby: {WHY_UNHEARD}")
    more = f" and {len(robots) - _NAMED} more robots" if len(robots) > _NAMED else ""
    return Look(State.OK, f"{said}: {', '.join(robots[:_NAMED])}{more}")


def _robot(seen: Seen) -> str:
    model = seen.robot.name if seen.robot else UNKNOWN_SPHERO
    strength = "" if seen.rssi is None else f", {seen.rssi} dBm"
    return f"{seen.name or seen.address} ({model}{strength})"
