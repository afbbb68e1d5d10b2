"""Expected find costs where looks can miss: Eq. 1 over states that count the looks into each candidate."""
