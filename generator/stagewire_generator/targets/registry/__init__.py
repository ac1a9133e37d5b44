"""``registry/<protocol>.json``: the resolved registry for every tool that does not read our YAML."""

from stagewire_generator.targets.registry.view import registry_text, render

__all__ = ["registry_text", "render"]
