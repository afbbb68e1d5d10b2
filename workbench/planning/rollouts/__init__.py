"""ScoutLIOS: first steps compared by rollouts in worlds drawn from the belief."""
