"""The only code that reads MCAP: runs, data frames, the logged world, counterfactuals, salvage."""
