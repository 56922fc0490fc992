"""Reports of heads: how far heads from photos are from the true ones, beside the mean head."""
