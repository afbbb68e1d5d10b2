"""A Spot that is not there: a gRPC server that speaks the robot's protocol, and a body that walks in a site."""
