"""The udev rules: valid keys, and the required contents."""

from __future__ import annotations

import re

from checkout import ROOT

RULES = ROOT / "examples" / "udev" / "70-stagewire.rules"
MATCHES = {"ACTION", "SUBSYSTEM", "DRIVER", "KERNEL", "ATTR", "ATTRS", "ENV"}
ASSIGNED = {"GROUP", "MODE", "TAG", "SYMLINK", "ATTR", "ENV", "RUN"}
PART = re.compile(r'([A-Z]+)(?:\{(\w+)\})?(==|!=|\+=|:=|=)"([^"]*)"')


def rules() -> list[dict[tuple[str, str, str], str]]:
    """Return every rule: key, text in braces and operator, with the value."""
    found = []
    for line in RULES.read_text("utf-8").splitlines():
        if line and not line.startswith("#"):
            parts = [PART.fullmatch(part) for part in re.split(r",\s+(?=[A-Z]+[{=+])", line)]
            assert all(parts), line
            found.append({(p[1], p[2] or "", p[3]): p[4] for p in parts if p})
    return found


def test_keys_are_only_compared_or_assigned_where_udev_allows() -> None:
    for rule in rules():
        for key, _, operator in rule:
            assert key in (MATCHES if operator in ("==", "!=") else ASSIGNED)


def test_each_rule_matches_only_controllers() -> None:
    for rule in rules():
        for attribute, value in (("idVendor", "0403"), ("idProduct", "faf0")):
            given = {rule.get((key, attribute, "==")) for key in ("ATTR", "ATTRS")}
            assert given == {None, value}


def test_a_link_by_serial_number_and_1_ms_latency() -> None:
    [port] = [rule for rule in rules() if rule["SUBSYSTEM", "", "=="] == "tty"]
    assert port["SYMLINK", "", "+="] == "stagewire/by-serial/$attr{serial}"
    assert port["GROUP", "", "="] == "dialout"
    [chip] = [rule for rule in rules() if rule["SUBSYSTEM", "", "=="] == "usb-serial"]
    assert chip["ATTR", "latency_timer", "="] == "1"
