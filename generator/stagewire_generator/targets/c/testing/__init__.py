"""``testing/``: layouts as data, worked examples and cases as arrays, and what runs them in C."""
