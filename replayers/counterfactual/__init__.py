"""Counterfactual replay: what another strategy would have done, as far as a log shows."""
