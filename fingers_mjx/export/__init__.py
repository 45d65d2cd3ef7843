"""Policy bundles: an ONNX graph with its manifest."""
