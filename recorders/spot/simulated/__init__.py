"""The simulated Spot: a gRPC server with the robot's protocol, and a body that moves in a site."""
