"""The panel's texts about an answer, as HTML: phrases and rounding are those of the page."""

from __future__ import annotations

import html
import re
from collections.abc import Mapping
from typing import Any

from .language import _, signs

GREY = "#767676"


class Words:
    """The phrases of the page by name, with their gaps filled."""

    def __init__(self, looks: Mapping[str, Any]) -> None:
        self.phrases: Mapping[str, str] = {name: _(text) for name, text in looks["words"].items()}
        self.ramp: list[dict[str, Any]] = looks["ramp"]
        self.stops: list[dict[str, str]] = [
            {**each, **{name: _(each[name]) for name in ("label",)}} for each in looks["stops"]
        ]

    def say(self, name: str, **gaps: Any) -> str:
        one = f"{name}_one"
        phrase = self.phrases[one if gaps.get("n") == 1 and one in self.phrases else name]
        return re.sub(r"\{(\w+)\}", lambda gap: str(gaps[gap[1]]), phrase)

    def choices(self, group: str) -> dict[str, str]:
        """The phrases whose names have this prefix, by the rest of the name."""
        start = f"{group}_"
        return {name[len(start) :]: text for name, text in self.phrases.items() if name.startswith(start)}

    def reach(self, answer: Mapping[str, Any], names: Mapping[str, str]) -> str:
        """Each line's share with its interval."""
        if not answer["reach"]:
            return _quiet(_("Choose a layer of roads, railways or houses to see how many logs reach them."))
        rows = []
        for each in answer["reach"]:
            digits = digits_of(100.0 * (each["ci_high"] - each["ci_low"]))
            low, high = (_number(100.0 * each[name], digits) for name in ("ci_low", "ci_high"))
            value = self.say("percent", p=_number(100.0 * each["p"], digits))
            interval = self.say("interval", low=low, high=high)
            said = self.say("reach_said", interval=interval, reached=each["n_reach"], done=answer["done"])
            rows.append(_row(self.name_of(each["line_id"], names), value) + _under(said))
        return _table(rows)

    def difference(self, answer: Mapping[str, Any], names: Mapping[str, str]) -> str:
        """What the change does to each line, on the same logs."""
        rows = []
        for each in answer["lines"]:
            digits = digits_of(100.0 * (each["ci_high"] - each["ci_low"]))
            value, low, high = (
                _number(100.0 * each[name], digits, signed=True) for name in ("difference", "ci_low", "ci_high")
            )
            before, after = (
                self.say("percent", p=_number(100.0 * each[name] / answer["done"], 1)) for name in ("before", "after")
            )
            verdict = "more" if each["ci_low"] > 0.0 else "less" if each["ci_high"] < 0.0 else "chance"
            lost, gained = (self.say(name, n=each[name]) for name in ("lost", "gained"))
            interval = self.say("interval_points", low=low, high=high)
            rows.append(
                _row(self.name_of(each["line_id"], names), self.say("points", d=value))
                + _under(f"{interval}; {before} → {after}")
                + _under(self.say(f"verdict_{verdict}"))
                + _under(f"{lost}; {gained}")
            )
        note = self.say("paired_note", concerned=answer["concerned"], done=answer["done"])
        return _table(rows) + _quiet(note)

    def fidelity(self, fidelities: list[dict[str, Any]], name: str) -> str:
        """The error of the fidelity itself."""
        if name == fidelities[-1]["name"]:
            return _quiet(self.say("error_none", fidelity=name))
        found = next((each for each in fidelities if each["name"] == name), None)
        if found is None or found["error_points"] is None:
            return _quiet(self.say("error_unknown", fidelity=name))
        value, low, high = (_number(found[each], 1, signed=True) for each in ("error_points", "ci_low", "ci_high"))
        if not found.get("sd"):
            return _quiet(self.say("error_known", fidelity=name, value=value, low=low, high=high))
        sd, sd_low, sd_high = (_number(each, 1) for each in found["sd"])
        more = {"sd": sd, "sd_low": sd_low, "sd_high": sd_high}
        return _quiet(self.say("error_slopes", fidelity=name, value=value, low=low, high=high, **more))

    def legend(self, answer: Mapping[str, Any]) -> str:
        """The meaning of the colours: hits of cells, and where logs ended."""
        cells = "".join(f'<td width="5" bgcolor="{each["colour"]}">&nbsp;</td>' for each in self.ramp)
        least, most = (self.say("percent", p=signs(f"{100.0 * self.ramp[k]['share']:g}")) for k in (0, -1))
        said = (
            f"{self.say('legend_hits')} ({self.say('legend_logs', done=answer['done'], fidelity=answer['fidelity'])})"
        )
        scale = f"<td>{least}&nbsp;</td>{cells}<td>&nbsp;{most}</td>"
        ramp = f'<table cellspacing="0" cellpadding="0"><tr>{scale}</tr></table>'
        ends = [
            f'<span style="color:{each["colour"]}">&#9679;</span> {html.escape(each["label"])}: {count}'
            for each in self.stops
            if (count := answer["stopped"].get(each["reason"]))
        ]
        return f"<p>{html.escape(said)}</p>{ramp}<p>{'<br>'.join(ends)}</p>"

    def name_of(self, line: str, names: Mapping[str, str]) -> str:
        name = names.get(line, line)
        return self.say("line", id=name) if re.fullmatch(r"[\d.]+", name) else name


def digits_of(width: float) -> int:
    """Decimals that an interval of this width [points] justifies."""
    return 0 if width >= 10.0 else 1 if width >= 0.5 else 2


def _number(value: float, digits: int, *, signed: bool = False) -> str:
    text = f"{value:+.{digits}f}" if signed else f"{value:.{digits}f}"
    if float(text) == 0.0:
        text = text.lstrip("+-")
    return signs(text.replace("-", "\N{MINUS SIGN}"))


def _row(name: str, value: str) -> str:
    return f'<tr><td><b>{html.escape(name)}</b></td><td align="right"><b>&nbsp;&nbsp;{html.escape(value)}</b></td></tr>'


def _under(text: str) -> str:
    return f'<tr><td colspan="2">{html.escape(text)}</td></tr>'


def _table(rows: list[str]) -> str:
    return f'<table width="100%">{"".join(rows)}</table>'


def _quiet(text: str) -> str:
    return f'<p style="color:{GREY}">{html.escape(text)}</p>'
