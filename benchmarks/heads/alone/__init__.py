"""Measurements of heads that are commands of their own."""
