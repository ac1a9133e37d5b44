"""Controllers made of software (being built)."""
