"""Rendered people with dense body-surface labels."""
