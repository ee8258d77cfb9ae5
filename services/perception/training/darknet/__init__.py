"""Networks of the Darknet family, as the paper used them, as ONNX files."""
