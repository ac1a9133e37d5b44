"""A second, independent reading of Issue 37, compared with our transcription."""
