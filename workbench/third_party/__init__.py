"""Code from outside that runs in this process."""
