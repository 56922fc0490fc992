"""Steps that change an ONNX graph, and what an int8 graph holds."""
