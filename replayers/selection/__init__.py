"""Selection of the strategy to drive next, from replays over the trials so far: proofs, sequences, regret."""
