"""The most influential inputs of an answer: factors and their ranges, designs of runs, and what is read from them."""
