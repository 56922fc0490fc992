"""Clips of several people who move, with exact ids, labels and joints."""
