"""Object search by a robot that sees in passing: Eq. 1 with what comes into view on every path."""
