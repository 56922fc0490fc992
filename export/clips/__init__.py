"""Clips with exact motion, for the prediction of frames."""
