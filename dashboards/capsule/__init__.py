"""One HTML file that plays runs offline."""
