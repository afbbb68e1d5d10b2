"""Expected costs of finding objects (Eq. 1), and search policies."""
