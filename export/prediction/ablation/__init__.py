"""What was chosen by comparison: how many codes of which size, and in which order a frame is decoded."""
