"""What memory of earlier runs saves: in searches and in tasks, in houses in which things have moved since."""
