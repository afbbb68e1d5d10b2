"""Screens in the pictures of a log: TVs, monitors, laptops, phones and tablets, by weights that the user names."""
