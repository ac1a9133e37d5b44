"""``testing/``: layouts as data, worked examples and cases as arrays, and programs that run them in C."""
