"""Language as a sensor: parse, annotation inference and behaviour inference (paper, sec:nlu)."""
