"""Heads of scanned people, brought into the vertices of the template head."""
