"""What the transformer draws of coming frames, beside the last frame and motion."""
