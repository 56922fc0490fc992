"""Static int8 quantization of model bundles, and its error."""
