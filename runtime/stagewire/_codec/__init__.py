"""What all framings share: messages, flags, events and the base of protocols."""
