"""Rules for the resolved registry; each rule is a function in one of these modules."""
