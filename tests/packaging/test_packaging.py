"""The wheel: its content, and that it works without a checkout and without extras."""

from __future__ import annotations

import configparser
import email
import json
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from email.message import Message
from pathlib import Path, PurePosixPath

import jinja2
import pytest

from checkout import ROOT
from stagewire_generator import check, render
from stagewire_generator.model import Protocol
from stagewire_generator.targets.environment import compiled_templates, our_templates

pytestmark = pytest.mark.matrix

PACKAGES = {
    "stagewire": ROOT / "runtime",
    "stagewire_apt": ROOT / "generated" / "python",
    "stagewire_ms2000": ROOT / "generated" / "python",
    "stagewire_bluesky": ROOT / "control",
    "stagewire_epics": ROOT / "control",
    "stagewire_pymmcore": ROOT / "control",
    "stagewire_cli": ROOT / "cli",
    "stagewire_conformance": ROOT / "conformance",
    "stagewire_generator": ROOT / "generator",
    "stagewire_virtual": ROOT / "virtual",
}
COMPILED = "stagewire_generator/targets/compiled/"
EXTRA = ("yaml", "jinja2", "jsonschema", "jsonschema_rs", "junitparser", "ruamel")
MOVE = "53 04 06 00 D0 01 01 00 40 0D 03 00"

# Use only the standard library, the wheel and the other installed packages. Python ignores the .pth files of
# folders appended to sys.path, so an editable checkout is not imported.
PRELUDE = """
import sys
assert sys.flags.isolated and sys.flags.no_site
wheel, installed, hidden = sys.argv[1], sys.argv[2].split(";"), sys.argv[3].split()
sys.path[:0] = [wheel]
sys.path += installed
sys.modules.update(dict.fromkeys(hidden))
del sys.argv[1:4]
"""
COMMAND = PRELUDE + "from stagewire_cli.main import run; run()"


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built once and without a network."""
    folder = tmp_path_factory.mktemp("wheel")
    words = ["wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    done = subprocess.run(
        [sys.executable, "-m", "pip", *words, "--wheel-dir", str(folder), str(ROOT)],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    (made,) = folder.glob("*.whl")
    return made


@pytest.fixture(scope="session")
def names(wheel: Path) -> list[str]:
    with zipfile.ZipFile(wheel) as archive:
        return archive.namelist()


@pytest.fixture(scope="session")
def unpacked(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("unpacked")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


@pytest.fixture(scope="session")
def metadata(unpacked: Path) -> Message:
    (path,) = unpacked.glob("*.dist-info/METADATA")
    return email.message_from_bytes(path.read_bytes())


def python(
    unpacked: Path, code: str, *arguments: object, hidden: tuple[str, ...] = EXTRA, input: str = ""
) -> subprocess.CompletedProcess[str]:
    """Run ``code`` with only the wheel. The modules in ``hidden`` cannot be imported."""
    installed = ";".join(dict.fromkeys(sysconfig.get_path(key) for key in ("purelib", "platlib")))
    words = [str(unpacked), installed, " ".join(hidden), *map(str, arguments)]
    return subprocess.run(
        [sys.executable, "-I", "-S", "-X", "utf8", "-c", code, *words],
        capture_output=True,
        encoding="utf-8",
        timeout=120,
        cwd=unpacked.parent,
        input=input,
    )


def test_the_wheel_has_every_file_of_the_packages_and_no_other(names: list[str]) -> None:
    wanted = {
        path.relative_to(folder).as_posix()
        for package, folder in PACKAGES.items()
        for path in (folder / package).rglob("*")
        if path.is_file() and not {"__pycache__", "compiled"} & {*path.parts}
    }
    schemas = {f"stagewire_generator/schema/{p.name}" for p in (ROOT / "spec/schema").iterdir()}
    assert schemas
    found = {name for name in names if ".dist-info/" not in name and COMPILED not in name}
    assert found == wanted | schemas


def test_every_template_is_compiled(unpacked: Path, names: list[str]) -> None:
    templates = [
        name for name in names if name.startswith("stagewire_generator/") and name.endswith(".j2")
    ]
    assert templates
    modules = {
        f"{COMPILED}{compiled_templates(our_templates()).name}/"
        + jinja2.ModuleLoader.get_module_filename(PurePosixPath(name).name)
        for name in templates
    }
    assert {name for name in names if name.startswith(COMPILED)} == modules
    code = """
from stagewire_generator.targets.templates import Templates, our_templates
for path in our_templates():
    print(Templates()._environment.get_template(path.name).filename)
"""
    done = python(unpacked, PRELUDE + code, hidden=())
    assert done.stderr == ""
    assert {
        Path(line).relative_to(unpacked).as_posix() for line in done.stdout.split("\n")[:-1]
    } == modules


def test_the_wheel_has_no_yaml_and_no_compiled_files(names: list[str]) -> None:
    suffixes = {PurePosixPath(name).suffix for name in names if ".dist-info/" not in name}
    assert suffixes == {".py", ".json", ".j2", ".c", ".h", ".cmake", ".tcss", ".typed"}


def test_every_package_is_typed(names: list[str]) -> None:
    assert {f"{package}/py.typed" for package in PACKAGES} <= set(names)


@pytest.fixture(scope="module")
def models() -> list[Protocol]:
    return check(ROOT / "spec")


@pytest.mark.parametrize("kind", ["registry", "vectors"])
@pytest.mark.parametrize(
    ("package", "protocol"),
    [("stagewire_apt", "thorlabs_apt"), ("stagewire_ms2000", "asi_ms2000")],
)
def test_the_json_in_the_wheel_is_up_to_date(
    unpacked: Path, models: list[Protocol], package: str, protocol: str, kind: str
) -> None:
    [made] = render([one for one in models if one.name == protocol], [kind]).values()
    assert (unpacked / package / f"{kind}.json").read_bytes() == made.encode("utf-8")


def test_the_wheel_declares_its_entry_points(unpacked: Path) -> None:
    (path,) = unpacked.glob("*.dist-info/entry_points.txt")
    points = configparser.ConfigParser()
    points.read_string(path.read_text(encoding="utf-8"))
    assert {section: dict(points[section]) for section in points.sections()} == {
        "console_scripts": {"stagewire": "stagewire_cli.main:run"},
        "stagewire.links": {"virtual": "stagewire_virtual.linking"},
        "stagewire.protocols": {
            "asi_ms2000": "stagewire_ms2000:PROTOCOL",
            "thorlabs_apt": "stagewire_apt:PROTOCOL",
        },
    }


def test_the_wheel_declares_its_requirements_and_extras(metadata: Message) -> None:
    needs = [str(need) for need in metadata.get_all("Requires-Dist", [])]
    plain = " ".join(need.lower() for need in needs if "extra ==" not in need)
    for name in EXTRA:
        assert name not in plain
        package = name.replace("_", "-")
        extras = [
            need.replace('"', "'")
            for need in needs
            if need.lower().startswith(("py" + package, package))
        ]
        assert any(need.endswith("extra == 'generator'") for need in extras), extras
    reports = {need.partition("<")[0] for need in needs if "extra == 'conformance'" in need}
    assert reports == {"jinja2", "junitparser"}
    assert metadata["License-File"] == "LICENSE"
    assert metadata["Requires-Python"] == ">=3.11"


def test_the_wheel_has_no_path_of_this_machine(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        for name in archive.namelist():
            assert str(ROOT).encode() not in archive.read(name), name


def test_the_packages_of_the_wheel_import_and_decode(unpacked: Path) -> None:
    code = """
import importlib, json, pathlib
files = []
for name in json.loads(sys.argv[1]):
    files.append(importlib.import_module(name).__file__)
from stagewire import End, available_protocols, load_protocol
from stagewire_apt import messages as m
frame = m.decode(bytes.fromhex(sys.argv[2]))
events = load_protocol("thorlabs_apt").framer(End.DEVICE).feed(frame.encode())
inside = all(pathlib.Path(file).is_relative_to(wheel) for file in files)
print(json.dumps([inside, available_protocols(), repr(frame.message), len(events)]))
"""
    control = {name for name, room in PACKAGES.items() if room == ROOT / "control"}
    packages = json.dumps(sorted(PACKAGES.keys() - control - {"stagewire_generator"}))
    done = python(unpacked, PRELUDE + code, packages, MOVE)
    assert done.stderr == ""
    message = "MotMoveAbsolute(chan_ident=1, absolute_distance=200000)"
    assert json.loads(done.stdout) == [True, ["asi_ms2000", "thorlabs_apt"], message, 1]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--version"], "stagewire "),
        (["show", "MOT_MOVE_ABSOLUTE"], "id 0x0453"),
        (["decode", MOVE], "form data, dest 0x50, source 0x01"),
        (["encode", "MOT_MOVE_ABSOLUTE", "--form", "data", "chan_ident=1", "absolute_distance=200000"], MOVE),
        (["testee"], '"protocols":["asi_ms2000","thorlabs_apt"]'),
        (["conformance", "examples"], " 0 failed, "),
        (["conformance", "device", "--unit", "TDC001", "--list"], "identification/0x50"),
        (["conformance", "rules", "--protocol", "asi_ms2000"], "position-reply"),
        (["virtual", "--list"], "TDC001"),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)  # fmt: skip
def test_the_command_runs_without_extras(unpacked: Path, words: list[str], said: str) -> None:
    done = python(unpacked, COMMAND, *words, input='{"id":1,"op":"hello"}\n')
    assert (done.returncode, done.stderr) == (0, "")
    assert said in done.stdout


CHECK, GENERATE = ("check", ROOT / "spec"), ("generate", "--check")


@pytest.mark.parametrize(
    ("words", "name"),
    [
        *(
            (words, name)
            for words in (CHECK, GENERATE)
            for name in ("yaml", "jinja2", "jsonschema_rs")
        ),
        ((*CHECK, "--format", "junit"), "junitparser"),
        (("format", "--check", ROOT / "spec"), "ruamel"),
    ],
    ids=lambda value: value if isinstance(value, str) else value[0],
)
def test_the_command_names_a_missing_extra(
    unpacked: Path, words: tuple[object, ...], name: str
) -> None:
    done = python(unpacked, COMMAND, *words, hidden=(name,))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        f"stagewire: this command needs {name}: run pip install 'stagewire[generator]'\n"
    )


@pytest.mark.parametrize(("option", "name"), [("--html", "jinja2"), ("--junit", "junitparser")])
def test_the_command_names_the_missing_extra_for_reports(
    unpacked: Path, tmp_path: Path, option: str, name: str
) -> None:
    words = ("conformance", "device", "virtual://TDC001", "--unit", "TDC001")
    done = python(unpacked, COMMAND, *words, option, tmp_path / "report", hidden=(name,))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        f"stagewire: {option} needs {name}: run pip install 'stagewire[conformance]'\n"
    )


def test_the_conformance_suite_of_the_wheel_writes_every_report(
    unpacked: Path, tmp_path: Path
) -> None:
    """The wheel includes the templates of the page; the generator's dependencies are not needed."""
    files = {name: tmp_path / f"report.{name}" for name in ("json", "junit", "html")}
    options = [word for name, path in files.items() for word in (f"--{name}", path)]
    words = (
        "conformance",
        "device",
        "virtual://TDC001",
        "--unit",
        "TDC001",
        "--only",
        "identification",
    )
    hidden = ("yaml", "jsonschema", "jsonschema_rs", "ruamel")
    done = python(unpacked, COMMAND, *words, *options, hidden=hidden)
    assert done.returncode == 0, done.stderr
    assert json.loads(files["json"].read_bytes())["verdict"] == "PASSED IN PART"
    assert files["html"].read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert b"<testsuites>" in files["junit"].read_bytes()


def test_the_command_names_the_extra_that_explains_errors(unpacked: Path, tmp_path: Path) -> None:
    """jsonschema is imported only to explain an error."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "protocol.yaml").write_text("protocol: 1\n", encoding="utf-8")
    done = python(unpacked, COMMAND, "check", tmp_path, hidden=("jsonschema",))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("stagewire: this command needs jsonschema: run pip install ")


def test_the_generator_of_the_wheel_checks_and_generates(unpacked: Path, tmp_path: Path) -> None:
    """The wheel includes the schemas, and the spec does not."""
    for name in ("asi_ms2000", "thorlabs_apt"):
        shutil.copytree(ROOT / "spec" / name, tmp_path / "spec" / name)
    done = python(unpacked, COMMAND, "check", tmp_path / "spec", hidden=())
    assert done.returncode == 0, done.stdout + done.stderr
    assert "thorlabs_apt: ok; " in done.stdout
    words = ["generate", "--spec", tmp_path / "spec", "--out", ROOT / "generated", "--check"]
    done = python(unpacked, COMMAND, *words, hidden=())
    assert done.returncode == 0, done.stdout + done.stderr
    assert "files, up to date" in done.stdout
