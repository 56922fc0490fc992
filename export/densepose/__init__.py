"""Mobile Parsing R-CNN in torch: the network, its training, the reference decode, the ONNX export."""
