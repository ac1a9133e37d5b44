"""A second, independent reading of the vendor's document, compared with our transcription."""
