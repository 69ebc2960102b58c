"""``python -m deadwood_toolbox`` is ``deadwood-tool``, also where the script is not on the PATH."""

from deadwood_toolbox.cli import main

main()
