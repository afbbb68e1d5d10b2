"""The built-in solver: recipes, matching, and an exact compiled search."""
