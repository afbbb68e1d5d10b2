"""The one closed loop: look, believe, plan, act. It yields events."""
