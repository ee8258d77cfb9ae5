"""From boxes and depths to things in space: where, how large, which way, how surely."""
