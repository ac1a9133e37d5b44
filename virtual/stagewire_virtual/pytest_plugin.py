"""Fixtures for the tests of users (being built)."""
