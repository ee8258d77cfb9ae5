"""The distribution over maps: Algorithm 1 of the paper, language being one of the sensors."""
