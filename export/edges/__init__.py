"""Distance to sharp features on depth frames (DEF): network, losses, training, evaluation and ONNX export."""
