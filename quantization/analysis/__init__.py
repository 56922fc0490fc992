"""The error of an int8 graph: of its outputs, of each tensor, and of sums that overflow."""
