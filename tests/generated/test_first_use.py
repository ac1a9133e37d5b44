"""Importing a generated package loads no message; every name is imported on first use."""

from __future__ import annotations

import ast
import importlib
import inspect
import pickle
import pydoc
import subprocess
import sys
from types import ModuleType

import pytest

import stagewire_apt
import stagewire_ms2000

PACKAGES = (stagewire_apt, stagewire_ms2000)
OBJECTS = ("PROTOCOL", "decode")
"""The names that are not modules or units."""


def fresh(program: str, *arguments: str) -> str:
    """Run a program in a new process, and return its output."""
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert not done.stderr
    return done.stdout


def home(package: ModuleType, name: str) -> object:
    """Return what a name of a package must be, from the module that defines it."""
    if name in OBJECTS:
        return getattr(importlib.import_module(f"{package.__name__}.messages"), name)
    if name[0].isupper():
        return getattr(importlib.import_module(f"{package.__name__}.devices.units"), name)
    return importlib.import_module(f"{package.__name__}.{name}")


IMPORTED = """
import importlib, sys
from stagewire import Flags, Message
name = sys.argv[1]
def below(cls):
    return {cls.__module__, *(m for sub in cls.__subclasses__() for m in below(sub))}
package = importlib.import_module(name)
names = {*dir(package)}
loaded = [m for m in sys.modules if m.startswith(name + ".")]
made = [m for cls in (Flags, Message) for m in below(cls) if m.startswith(name)]
assert not loaded and not made, (loaded, made)
assert names >= {*package.__all__}, "dir() shows names before their first use"
package.decode
assert name + ".messages" in sys.modules
assert name + ".devices" not in sys.modules, "messages need no device class"
"""


@pytest.mark.parametrize("package", PACKAGES)
def test_an_import_creates_no_class_of_the_package(package: ModuleType) -> None:
    assert fresh(IMPORTED, package.__name__) == ""


@pytest.mark.parametrize("package", PACKAGES)
def test_every_name_is_that_of_its_module(package: ModuleType) -> None:
    for name in package.__all__:
        found = getattr(package, name)
        assert found is home(package, name)
        assert vars(package)[name] is found, "the next use does not search again"
        assert inspect.getdoc(found)


@pytest.mark.parametrize("package", PACKAGES)
def test_type_checkers_see_every_name(package: ModuleType) -> None:
    [block] = [node for node in ast.parse(inspect.getsource(package)).body
               if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"]  # fmt: skip
    seen = {
        alias.name: node.module
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert seen.keys() == {*package.__all__}
    for name, module in seen.items():
        assert getattr(importlib.import_module(str(module)), name) is getattr(package, name)


USES = (
    "from stagewire_apt import *; used = decode",
    "import stagewire_apt; used = stagewire_apt.decode",
    "from stagewire_apt import decode as used",
    "from stagewire_apt import PROTOCOL; used = PROTOCOL.decode",
    "from stagewire_apt import messages; used = messages.decode",
    "from stagewire_apt.messages.motor import MotMoveHome; from stagewire_apt import decode as used",
    "from stagewire import load_protocol; used = load_protocol('thorlabs_apt').decode",
)


@pytest.mark.parametrize("use", USES)
def test_the_first_use_may_be_in_any_form(use: str) -> None:
    shown = fresh(f"{use}; print(used(bytes.fromhex('430401005001')).message)")
    assert shown == "MotMoveHome(chan_ident=1)\n"


def test_a_message_can_be_unpickled_in_a_process_that_has_not_used_one() -> None:
    message = stagewire_apt.messages.MotMoveAbsolute(1, -200_000)
    shown = fresh(
        "import pickle, sys, stagewire_apt; print(pickle.loads(bytes.fromhex(sys.argv[1])))",
        pickle.dumps(message).hex(),
    )
    assert shown == f"{message}\n"


THREADS = """
import threading, stagewire_apt
start, found = threading.Barrier(8), []
def use():
    start.wait()
    found.append(stagewire_apt.decode(bytes.fromhex("430401005001")).message)
threads = [threading.Thread(target=use) for _ in range(8)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print(len(found), {*found})
"""


def test_the_first_use_may_be_in_several_threads() -> None:
    assert fresh(THREADS) == "8 {MotMoveHome(chan_ident=1)}\n"


def test_help_lists_what_the_package_contains() -> None:
    text = pydoc.plain(pydoc.render_doc(stagewire_apt.messages.motor))
    assert "class MotMoveHome(" in text
    text = pydoc.plain(pydoc.render_doc(stagewire_apt))
    assert "class TDC001(" in text
    assert "PROTOCOL = <Protocol thorlabs_apt: " in text


@pytest.mark.parametrize("package", PACKAGES)
def test_an_unknown_name_is_an_error(package: ModuleType) -> None:
    with pytest.raises(AttributeError, match=f"'{package.__name__}' has no attribute 'encode'"):
        _ = package.encode


REFUSED = """
import sys
from stagewire import support
support.VERSION += 1
try:
    __import__(sys.argv[1])
except support.SupportVersionError as error:
    print(error)
"""


@pytest.mark.parametrize("package", PACKAGES)
def test_an_import_already_refuses_another_version_of_the_runtime(package: ModuleType) -> None:
    assert "generate the package again" in fresh(REFUSED, package.__name__)
