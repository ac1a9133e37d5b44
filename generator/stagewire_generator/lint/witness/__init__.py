"""The transcription of a printed document (the witness), compared with the registry."""
