"""Run times, measured through the C API."""
