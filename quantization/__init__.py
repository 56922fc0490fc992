"""Static int8 quantisation of model bundles, and its error."""
