"""Resolve loaded YAML into the frozen model: follow references, expand sets, compute offsets.

An entry that cannot be resolved becomes a diagnostic and is left out of the model, so that one error does not
hide the next.
"""
