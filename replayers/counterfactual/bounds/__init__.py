"""Lower and upper bounds on the cost of a counterfactual run over all consistent worlds."""
