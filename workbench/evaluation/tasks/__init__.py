"""The task-planning experiment."""
