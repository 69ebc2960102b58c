"""The documentation's site: ``python -m docs`` builds it from this folder, the declarations and the pages elsewhere."""
