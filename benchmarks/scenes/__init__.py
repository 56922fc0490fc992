"""New views of captured places: quality, speed, memory."""
