"""What `import stagewire` gives, whether it is there at once or imported when it is asked for."""

from __future__ import annotations

from importlib import metadata

import pytest

import stagewire
from stagewire import quantities


@pytest.mark.parametrize("name", stagewire.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(stagewire, name).__name__ == name


@pytest.mark.parametrize("name", ["Scale", "Stage", "UnknownScale"])
def test_names_of_quantities(name: str) -> None:
    assert getattr(stagewire, name) is getattr(quantities, name)


def test_other_names_are_not_there() -> None:
    with pytest.raises(AttributeError, match="module 'stagewire' has no attribute 'Nonsense'"):
        _ = stagewire.Nonsense


def test_the_version_is_that_of_the_distribution() -> None:
    assert stagewire.__version__ == metadata.version("stagewire")
