"""From loaded YAML to the frozen model: references followed, sets opened, offsets counted.

Whatever cannot be resolved becomes a diagnostic and is left out of the model, so that one error does
not hide the next.
"""
