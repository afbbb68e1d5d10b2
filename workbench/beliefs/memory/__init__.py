"""Memory of earlier runs: what they saw, how fast such things move, and beliefs that use both."""
