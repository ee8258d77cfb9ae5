"""From a picture to boxes: any YOLO, its scores as probabilities."""
