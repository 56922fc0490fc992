"""Real places: photographs fetched, posed and made dense."""
