"""Parameters, comparisons and changes in lines for people and as JSON."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from telemetry.parameters.comparing import Comparison
from telemetry.parameters.described import Description
from telemetry.parameters.files import FileParameter, value_text
from telemetry.topics.parameters import Parameter, ParameterWritten

Descriptions = Mapping[str, Description]
_NONE = Description()
_WORDS = {
    "set": "set, read back",
    "same": "was so already",
    "adjusted": "NOT AS ASKED",
    "kept": "NOT SET",
    "refused": "NOT SET",
    "unknown": "UNKNOWN",
    "not sent": "NOT SENT",
}


def parameter_lines(parameters: Iterable[Parameter], described: Descriptions) -> list[str]:
    return [_line(parameter, described.get(parameter.name, _NONE)) for parameter in parameters]


def _line(parameter: Parameter, about: Description) -> str:
    value = f"{value_text(parameter.value, parameter.kind)} {about.unit}".rstrip()
    meaning = "" if parameter.value is None else about.meaning(parameter.value)
    extent = "" if about.low is None or about.high is None else f"{about.low:g} to {about.high:g}"
    known = "; ".join(part for part in (meaning, about.title, extent) if part)
    return f"{parameter.name:<16}  {value}{f'  ({known})' if known else ''}"


def parameter_json(parameter: Parameter, described: Descriptions) -> dict[str, Any]:
    about = described.get(parameter.name, _NONE)
    return {
        "name": parameter.name,
        "value": parameter.value,
        "type": parameter.kind,
        "title": about.title,
        "text": about.text,
        "unit": about.unit,
        "low": about.low,
        "high": about.high,
        "default": about.default,
        "meaning": "" if parameter.value is None else about.meaning(parameter.value),
        "reboot": about.reboot,
    }


def comparison_lines(made: Comparison, here: str, there: str) -> list[str]:
    """``here`` and ``there``: what the two are called."""
    lines = [f"The same in both: {made.same}. Different: {len(made.different)}."]
    lines += [
        f"  {d.name:<16}  {here} {value_text(d.here, d.kind)}, {there} {value_text(d.there, d.kind)}"
        for d in made.different
    ]
    for title, only in ((here, made.only_here), (there, made.only_there)):
        if only:
            lines.append(f"Only in {title}: {len(only)}.")
            lines += [f"  {p.name:<16}  {value_text(p.value, p.kind)}" for p in only]
    return lines


def comparison_json(made: Comparison) -> dict[str, Any]:
    return {
        "equal": made.is_equal,
        "same": made.same,
        "different": [{"name": d.name, "here": d.here, "there": d.there} for d in made.different],
        "only_here": [_entry(p) for p in made.only_here],
        "only_there": [_entry(p) for p in made.only_there],
    }


def _entry(parameter: FileParameter) -> dict[str, Any]:
    return {"name": parameter.name, "value": parameter.value}


def written_line(written: ParameterWritten) -> str:
    """Before, after, and why not."""
    before = "?" if written.before is None else value_text(written.before)
    line = f"{written.name}: {before} -> {value_text(written.asked)}: {_WORDS[written.outcome]}"
    if written.outcome in ("adjusted", "kept") and written.after is not None:
        line += f", the vehicle holds {value_text(written.after)}"
    return f"{line}. {written.words}".rstrip()


def written_json(written: Iterable[ParameterWritten]) -> dict[str, Any]:
    rows = [
        {
            "name": w.name,
            "before": w.before,
            "asked": w.asked,
            "after": w.after,
            "outcome": w.outcome,
            "took": w.took,
            "words": w.words,
        }
        for w in written
    ]
    return {"complete": all(row["took"] for row in rows), "written": rows}


def written_summary(written: list[ParameterWritten], described: Descriptions) -> list[str]:
    """The last lines: what did not take, and what counts from the next start on."""
    missed = [w.name for w in written if not w.took]
    sent = sum(w.outcome == "set" for w in written)
    same = sum(w.outcome == "same" for w in written)
    lines = [f"{sent} set and read back, {same} were so already, {len(missed)} did not take."]
    if missed:
        lines.append(f"Did not take: {', '.join(missed)}.")
    restart = [w.name for w in written if w.outcome == "set" and described.get(w.name, _NONE).reboot]
    if restart:
        lines.append(f"Restart the vehicle for: {', '.join(restart)}.")
    return lines
