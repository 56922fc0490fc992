"""Cameras rotated upright, the visible point of each pixel, and which photos see a point."""
