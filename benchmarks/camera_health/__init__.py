"""Measures camera health on real films into which events are put."""
