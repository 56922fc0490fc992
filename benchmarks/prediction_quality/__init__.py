"""Measures the similarity of predicted and true images, and the error of the estimated motion."""
