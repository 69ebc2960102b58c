"""The front door of the Deadwood Toolbox: the ``deadwood-tool`` command."""
