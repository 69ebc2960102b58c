"""The report of a run: one page with maps, figures, tables and a 3-D view, for use without a network."""
