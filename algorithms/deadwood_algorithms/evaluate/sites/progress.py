"""The hidden working folder of a run over sites, and whether an existing run in it is still valid."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from deadwood_algorithms.files.input_files import MANIFEST
from deadwood_algorithms.params.tool import Feedback, Tool, UserError
from deadwood_algorithms.results.checked import stands
from deadwood_algorithms.results.identity import Making
from deadwood_algorithms.results.run_folder import link_or_copy
from deadwood_algorithms.simulate.checkpoints import part_path, working_folder


class SitesFolder:
    """The folder ``.NAME.part`` beside the output: ``sites/SITE`` is a whole run, ``.SITE.json`` its ``run_id``."""

    def __init__(self, output: str, *, resume: bool, feedback: Feedback) -> None:
        self.path = working_folder(output)
        self.sites, self.releases = self.path / "sites", self.path / "releases"
        if self.path.is_dir() and not resume:  # with nothing that could be continued (`refuse_unfinished`)
            shutil.rmtree(self.path)
        elif resume and not self.path.is_dir():
            feedback.note(f"{self.path}: there is no unfinished work to resume; all sites are slid")
        self.sites.mkdir(parents=True, exist_ok=True)

    @staticmethod
    def is_of(output: str) -> bool:
        """Whether the output is an earlier result of sites, to which unfinished work belongs."""
        try:
            made = json.loads((Path(output) / MANIFEST).read_text(encoding="utf-8"))
            return made["tool"] == "run-sites" and part_path(output).is_dir()
        except (OSError, ValueError, KeyError, TypeError):
            return False

    def bring_to(self, folder: Path, names: Sequence[str]) -> None:
        """Move the runs of these sites and their layers of releases there, on the same disk if possible."""
        for name in names:
            shutil.copytree(self.sites / name, folder / "sites" / name, copy_function=link_or_copy)
            layer = self.releases / f"{name}.gpkg"
            if layer.is_file():
                (folder / "releases").mkdir(exist_ok=True)
                link_or_copy(str(layer), str(folder / "releases" / layer.name))

    def begin(self, name: str, slides: Tool, values: Mapping[str, Any], feedback: Feedback) -> bool:
        """Whether the site's run exists, complete, with the same inputs, parameters and engine; otherwise it is
        discarded.
        """
        run, part, note = self.sites / name, self.sites / f".{name}.part", self.sites / f".{name}.json"
        making: dict[str, Any] = {"run_id": Making(slides, slides.ask_from({**values, "output": str(run)})).run_id}
        making["report"] = values.get("report")
        try:
            same = json.loads(note.read_text(encoding="utf-8")) == making
        except (OSError, ValueError):
            same = False
        if not same:
            if run.is_dir() or part.is_dir():
                feedback.note(f"{name}: its inputs or parameters, or the engine, have changed; it is slid again")
            for each in (run, part):
                shutil.rmtree(each, ignore_errors=True)
            beside = note.with_suffix(".partial")
            beside.write_text(json.dumps(making), encoding="utf-8")
            os.replace(beside, note)
        elif run.is_dir() and not stands(slides, values, run):
            feedback.note(f"{name}: its files are damaged or belong to another run; it is slid again")
            shutil.rmtree(run, ignore_errors=True)
        return run.is_dir()

    @contextmanager
    def removed_if_refused(self) -> Iterator[None]:
        """Leave nothing behind if the sites are refused before one of them has begun."""
        try:
            yield
        except UserError:
            if not any(self.sites.iterdir()):
                self.remove()
            raise

    def remove(self) -> None:
        shutil.rmtree(self.path, ignore_errors=True)
