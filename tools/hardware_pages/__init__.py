"""The tables of units and stages in README.md and ``docs/hardware/``, written from the registry."""
