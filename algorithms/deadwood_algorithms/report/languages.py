"""The languages of the report; each but English has its catalogue in ``locale``."""

LANGUAGES = ("en", "de", "fr", "it")
