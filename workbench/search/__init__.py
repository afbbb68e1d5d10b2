"""What it costs, on average, to find an object (Eq. 1), and in which order to look."""
