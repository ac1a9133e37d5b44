"""The public names of the runtime. A change of ``public_names.json`` changes the public interface."""

from __future__ import annotations

import importlib
import json
import pkgutil
from importlib import metadata
from pathlib import Path
from types import ModuleType

import pytest

import stagewire
from stagewire import _lazy, columns, links, quantities, support
from stagewire.errors import SupportVersionError

NAMES: dict[str, list[str]] = json.loads(
    Path(__file__).with_name("public_names.json").read_text(encoding="utf-8")
)
PUBLIC = [(module, name) for module, names in NAMES.items() for name in names]


def test_the_public_modules_are_listed() -> None:
    found = {f"stagewire.{module.name}" for module in pkgutil.iter_modules(stagewire.__path__)}
    assert {name for name in found if "._" not in name} == NAMES.keys() - {"stagewire"}


@pytest.mark.parametrize("module", NAMES)
def test_the_public_names_are_listed(module: str) -> None:
    names = importlib.import_module(module).__all__
    assert sorted(names) == NAMES[module]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("module", NAMES)
def test_dir_lists_the_public_names(module: str) -> None:
    listed = dir(importlib.import_module(module))
    assert set(NAMES[module]) <= set(listed)


def test_dir_of_the_package_lists_its_public_modules() -> None:
    modules = {name.removeprefix("stagewire.") for name in NAMES.keys() - {"stagewire"}}
    assert set(dir(stagewire)) == modules | set(NAMES["stagewire"])
    for name in modules:
        assert getattr(stagewire, name) is importlib.import_module(f"stagewire.{name}")


@pytest.mark.parametrize("module", NAMES)
def test_every_public_module_has_a_docstring(module: str) -> None:
    assert importlib.import_module(module).__doc__


@pytest.mark.parametrize(("module", "name"), PUBLIC)
def test_every_public_name_has_a_docstring(module: str, name: str) -> None:
    value = getattr(importlib.import_module(module), name)
    assert not name.startswith("_")
    assert not isinstance(value, ModuleType)
    if isinstance(value, type) or callable(value):
        assert value.__doc__


@pytest.mark.parametrize("module", NAMES)
def test_unknown_names_raise_attribute_error(module: str) -> None:
    with pytest.raises(AttributeError, match=rf"module '{module}' has no attribute 'Nonsense'"):
        _ = importlib.import_module(module).Nonsense


@pytest.mark.parametrize("name", ["Scale", "Stage", "UnknownScale"])
def test_names_of_quantities_are_exported_at_the_top(name: str) -> None:
    assert getattr(stagewire, name) is getattr(quantities, name)


def test_renamed_classes_keep_their_old_names() -> None:
    assert columns.Place is columns.Field
    assert links.LineSettings is links.LinkSettings


def test_a_lazy_name_can_have_another_name_in_its_module(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(quantities, "Rate", None, raising=False)
    load, _ = _lazy.lazy("stagewire.quantities", {"quantities": "Scale=Rate Stage"})
    assert load("Rate") is quantities.Scale
    assert load("Stage") is quantities.Stage


def test_the_version_is_that_of_the_distribution() -> None:
    assert stagewire.__version__ == metadata.version("stagewire")


# The version that generated packages require


def test_the_current_version_is_accepted() -> None:
    support.require(support.VERSION)


@pytest.mark.parametrize(
    ("version", "advice"),
    [(support.VERSION + 1, "upgrade stagewire"), (0, "generate the package again")],
)
def test_another_version_is_refused(version: int, advice: str) -> None:
    wrong = rf"requires version {version} of stagewire\.support, .* has version \d+; {advice}"
    with pytest.raises(SupportVersionError, match=wrong):
        support.require(version)


@pytest.mark.parametrize("package", ["stagewire_apt", "stagewire_ms2000"])
def test_generated_packages_state_the_version_that_they_require(package: str) -> None:
    made = importlib.import_module(package)
    assert f"\n_require({support.VERSION})\n" in Path(str(made.__file__)).read_text("utf-8")
