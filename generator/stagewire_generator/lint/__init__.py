"""Rules that the resolved registry must keep; each rule is a function of one module here."""
