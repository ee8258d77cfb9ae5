"""Episodes and the paper's experiments. Only here may ground truth meet the services."""
