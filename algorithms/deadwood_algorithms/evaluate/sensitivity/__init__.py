"""What of the inputs an answer hangs on: factors and their ranges, designs of runs, and what is read from them."""
