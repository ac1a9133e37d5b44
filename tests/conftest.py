"""Puts this folder on the import path: what several rooms of the tests share stands here."""
