"""Measures new views of captures: quality, speed, memory."""
