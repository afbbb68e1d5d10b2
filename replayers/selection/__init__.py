"""Which strategy to drive next, from replays of all of them over the trials so far: proofs, sequences, regret."""
