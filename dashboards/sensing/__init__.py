"""What a robot's sensors saw at a moment: pictures, point clouds, local grids, placed on the map."""
