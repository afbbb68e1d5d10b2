"""The simulated Spot's gRPC services, one a module."""
