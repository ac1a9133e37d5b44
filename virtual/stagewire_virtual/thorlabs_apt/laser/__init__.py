"""Lasers: diode drivers (KLD101, TLD001) and laser sources (KLS101, KLS635, KLS1550, TLS001).

Issue 37, pages 295 to 326. ``laser`` has the output that both share, ``driver`` and ``source`` the two kinds.
"""
