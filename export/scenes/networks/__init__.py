"""The networks of NPBG++ in torch: extractor, basis of view directions, refiners; together as one system."""
