"""Reports of heads: distance of heads from photos to the true heads, beside the mean head."""
