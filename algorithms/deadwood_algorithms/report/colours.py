"""The colours of what lies on the report's maps; how logs end has its colours in ``files.styles``."""

TREE, BARRIER, LYING, BLOCK = "#006D4E", "#B2182B", "#8C510A", "#5A5A5A"
LINE, RELEASE, WAY = "#111111", "#882255", "#FFFFFF"
