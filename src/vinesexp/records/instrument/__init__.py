"""From an instrument file to clean SI samples, or one line that says why not."""
