"""Prediction of the next frames of a stream: Latent Video Transformer in torch."""
