"""Rendered places: multi-view scenes with exact cameras, images, depth and point clouds."""
