"""Pictures and videos of runs, made by a headless Chromium from the offline page."""
