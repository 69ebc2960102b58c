"""Which trees of a table are alive, which are dead but stand (snags: the releases), and which no longer stand.

For `import_trees`. Codings differ (lidaRtRee ``e``, ``Live_dead``, NEON ``plantStatus``, SORTIE ``Type``); the words of
each are data of its `sources.Layout`.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from deadwood_algorithms.files.columns import where_of
from deadwood_algorithms.params.commands import quoted
from deadwood_algorithms.params.counts import counted
from deadwood_algorithms.params.tool import Feedback, UserError
from deadwood_algorithms.prepare.trees.columns import find
from deadwood_algorithms.prepare.trees.sources import Layout

if TYPE_CHECKING:
    import pandas

LIVE, DEAD, GONE = range(3)
NAMES = ("living", "dead, standing", "no longer standing")
WORDS_SHOWN = 8
MOST_WORDS = 20  # different words in a field that may contain the status
# Parts of words for the status, in English, German, French and Italian, for words that are in no list. A tree that
# lies, was thrown or felled, or is a stump no longer stands, dead or not: this is therefore tested first.
GONE_PATTERN = re.compile(
    r"\b(lying|fallen|down(ed)?|(wind)?thrown|windthrows?|blowdown|uprooted|stump|cut|felled|removed|harvested|gone"
    r"|blown down|on (the )?ground"
    r"|liegend\w*|liegt|geworfen\w*|(wind|sturm)(wurf|bruch|holz)\w*|umgest[uü]\w*|umgefallen\w*|entwurzelt\w*"
    r"|wurzelteller|gefällt\w*|entnommen\w*|entfernt\w*|genutzt\w*"
    r"|geerntet\w*|(wurzel|baum)?stock|(baum)?stumpf|stubben|(baum)?strunk"
    r"|chablis|volis|tombée?s?|au sol|couchée?s?|renversée?s?|coupée?s?|abattue?s?|exploitée?s?|souches?|disparue?s?"
    r"|déracinée?s?|schiantat[oaie]|schiant[oi]|a terra|atterrat[oaie]|cadut[oaie]|sradicat[oaie]"
    r"|abbattut[oaie]|tagliat[oaie]|ceppai[ae]|ceppo)\b"
)
DEAD_PATTERN = re.compile(
    r"\b(dead|snags?|dürr\w*|duerr\w*|abgestorben\w*|tot|tote[rs]?|totholz|abgängig\w*"
    r"|hochst[uü]mpfe?|chandelles?|morte?s?|sur pied sec|sèche?s?|secs?|dépérie?s?|mort[oaie]|secc[oahi]+"
    r"|in piedi mort\w+)\b"
)
LIVE_PATTERN = re.compile(
    r"^(l|healthy|ok|vital\w*|gesund|vif|vive|saine?s?|san[oaie]|live, .*)$"
    r"|\b(a?live|living|lebend\w*|lebt|vivante?s?|viv[oaie])\b"
)
# Names of fields that ask whether a tree is dead, or alive, and the possible answers.
FLAGS: dict[str, str] = dict.fromkeys(
    ("dead", "is_dead", "isdead", "tot", "abgestorben", "dürr", "mort", "morto", "secco", "snag"), "dead"
)
FLAGS |= dict.fromkeys(("alive", "is_alive", "live", "living", "lebend", "lebt", "vivant", "vivo"), "live")
YES = ("1", "yes", "y", "true", "t", "ja", "j", "wahr", "oui", "o", "vrai", "sì", "si", "s", "vero", "x")
NO = ("0", "no", "n", "false", "f", "nein", "falsch", "non", "faux", "falso", "")
REMARKS = re.compile(r"remar[kq]|bemerk|anmerk|kommentar|comment|not(e|iz|a)|observ|osserv|hinweis", re.IGNORECASE)
# Names of fields that are filled for trees that were felled or have died: a date, a year, a number of a felling.
FELLED = re.compile(
    r"gef[äa]e?llt|f[äa]e?ll(ung|dat|jahr|ungs)|felled|felling|cut_?(date|year)|(date|year)_?(cut|removed)|removed"
    r"|removal|abatt(age|ue?s?\b)|date_?mort|taglio|abbattiment|abgang|entnahme",
    re.IGNORECASE,
)
NEGATED = re.compile(r"\b(not|no|non|pas|nicht|kein\w*)\b")


def status_of(
    source: pandas.DataFrame, layout: Layout, asked: str | None, dead: str | None, gone: str | None, feedback: Feedback
) -> np.ndarray:
    """LIVE, DEAD or GONE for each row; ``dead`` and ``gone`` are the user's lists of codes, which replace the layout's.

    Words in none of the lists are recognised by their parts (``liegend tot``, ``mort sur pied``, ``schiantato``). An
    unknown word, and an empty cell, counts as a living tree; a note reports the interpretation.
    """
    where = where_of(source)
    name = find(source, asked, "--status-field", layout.status)
    if name is None:
        if dead or gone:
            raise UserError(f"{where}: --dead-values and --gone-values need --status-field")
        if (flagged := flags_of(source)) is not None:
            name, is_dead = flagged
            feedback.note(
                f"{where}, field '{name}': {counted(is_dead.sum(), 'tree is', 'trees are')} dead, standing",
                code="status-read",
                trees=int(is_dead.sum()),
            )
            return np.where(is_dead, DEAD, LIVE)
        return warn_of_remarks(source, np.full(len(source), LIVE), None, feedback)
    words = [code_of(value) for value in source[name]]
    lists = [(DEAD, codes(dead) or layout.dead), (GONE, codes(gone) or layout.gone)]
    if gone and not dead:
        lists.reverse()  # the user's list takes precedence over the layout's
    meaning: dict[str, int | None] = {}
    for word in set(words):
        listed = next((kind for kind, of_kind in lists if word in of_kind), None)
        meaning[word] = listed if listed is not None else meaning_of(word, dead, gone)
    status = np.array([LIVE if meaning[word] is None else meaning[word] for word in words], np.int64)
    unknown = Counter(word for word in words if word and meaning[word] is None)
    if unknown and not (dead or gone or layout.sign or layout.columns):
        shown = ", ".join(f"{word}: {count}" for word, count in unknown.most_common(WORDS_SHOWN))
        feedback.warn(
            f"{where}, field '{name}': unknown values are taken as living trees ({shown}); name those of dead standing "
            f"trees with --dead-values, those of removed ones with --gone-values",
            code="status-unknown",
        )
    if asked or (status != LIVE).any():
        seen = Counter(zip(status.tolist(), words, strict=True))
        parts = []
        for kind, label in enumerate(NAMES):
            of_kind = [(word or "empty", count) for (its, word), count in seen.most_common() if its == kind]
            if of_kind:
                shown = ", ".join(f"{word}: {count}" for word, count in of_kind[:WORDS_SHOWN])
                parts.append(f"{label} ({shown}{', ...' if len(of_kind) > WORDS_SHOWN else ''})")
        feedback.note(f"{where}, field '{name}': {'; '.join(parts)}", code="status-read")
    return warn_of_remarks(source, status, name, feedback)


def warn_of_remarks(source: pandas.DataFrame, status: np.ndarray, used: str | None, feedback: Feedback) -> np.ndarray:
    """Warn if another field says of trees that count as living that they are dead or no longer stand."""
    for name in told_by(source, used):
        meant = np.array([_known(meaning_of(code_of(value), None, None)) for value in source[name]])
        dead, gone = (int(((status == LIVE) & (meant == kind)).sum()) for kind in (DEAD, GONE))
        if dead or gone:
            feedback.warn(
                f"{where_of(source)}: by the field '{name}' {dead} dead and {gone} fallen or removed trees count as "
                f"living ('{_telling_word(source[name])}'); --status-field {quoted(name)} reads it",
                code="status-not-read",
                dead=dead,
                gone=gone,
            )
            return status
    for name in source.columns:
        filled = np.array([code_of(value) not in NO for value in source[name]]) if FELLED.search(str(name)) else None
        if (
            name != used
            and filled is not None
            and not filled.all()
            and (count := int((filled & (status == LIVE)).sum()))
        ):
            feedback.warn(
                f"{where_of(source)}: the field '{name}' is filled for {counted(count, 'tree')} counted as living; "
                "if it says that they were felled, delete their rows, or name a field of the status with "
                "--status-field",
                code="status-not-read",
                gone=count,
            )
            break
    return status


def _known(kind: int | None) -> int:
    return LIVE if kind is None else kind


def meaning_of(word: str, dead: str | None, gone: str | None) -> int | None:
    """The meaning of a word that is in no list; None if unknown. A list given by the user is complete for its
    status.
    """
    if NEGATED.search(word):
        return None
    for kind, pattern, own in ((GONE, GONE_PATTERN, gone), (DEAD, DEAD_PATTERN, dead), (LIVE, LIVE_PATTERN, None)):
        if pattern.search(word):
            return LIVE if own else kind
    return None


def flags_of(source: pandas.DataFrame) -> tuple[str, np.ndarray] | None:
    """A field with yes or no for whether each tree is dead (or alive), and which trees are dead; None without such a
    field.
    """
    for name in source.columns:
        asks = FLAGS.get(str(name).strip().lower())
        words = [code_of(value) for value in source[name]] if asks else []
        if words and set(words) <= {*YES, *NO} and set(words) & {*YES}:
            yes = np.isin(words, YES)
            return str(name), yes if asks == "dead" else np.isin(words, NO[:-1])  # a gap is no information
    return None


def told_by(source: pandas.DataFrame, used: str | None) -> Iterator[str]:
    """Fields, other than the one used, with few different words, all known, or with remarks, some of which mean dead
    or removed trees.
    """
    import pandas

    for name in source.columns:
        if name in ("geometry", used) or pandas.api.types.is_numeric_dtype(source[name]):
            continue
        words = {code_of(value) for value in source[name]} - {""}
        meant = [meaning_of(word, None, None) for word in words]
        of_remarks = REMARKS.search(str(name)) is not None
        known = 0 < len(words) <= MOST_WORDS and None not in meant
        if (known or of_remarks) and any(kind not in (None, LIVE) for kind in meant):
            yield str(name)


def _telling_word(column: Iterable[object]) -> str:
    return next(word for word in map(code_of, column) if _known(meaning_of(word, None, None)) != LIVE)


def code_of(value: object) -> str:
    """A code as text in lower case; 3.0 is 3, an empty cell is empty."""
    if value is None or value != value:
        return ""
    if isinstance(value, (float, np.floating)) and float(value).is_integer():
        return str(int(value))
    return str(value).strip().lower()


def codes(text: str | None) -> tuple[str, ...]:
    """The codes of an option: separated by commas, or by semicolons where a code holds a comma."""
    parts = (text or "").split(";" if ";" in (text or "") else ",")
    return tuple(part.strip().lower() for part in parts if part.strip())
