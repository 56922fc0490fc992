"""Maquette's training side: rendered people, torch networks, training, evaluation, ONNX export."""
