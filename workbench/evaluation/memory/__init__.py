"""The memory experiment: what remembering earlier runs saves, in houses in which things have moved since."""
