"""The most influential inputs of a result: factors and their ranges, designs of runs, and their evaluation."""
