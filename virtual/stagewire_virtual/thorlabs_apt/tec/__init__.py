"""The controller of a thermoelectric cooler, TTC001, with a simulated load (Issue 37, pages 354 to 369)."""
