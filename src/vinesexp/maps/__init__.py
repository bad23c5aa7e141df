"""What a rig does over two of its parameters, and which motions it has side by side."""
