"""The speed/accuracy study: ``python -m benchmarks --help``. Not part of the installed package."""
