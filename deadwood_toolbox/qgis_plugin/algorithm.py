"""A tool of the toolbox as an algorithm of QGIS: everything in it comes from the tool's declaration."""

from __future__ import annotations

import html
from typing import Any

from qgis.core import (
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeedback,
)
from qgis.PyQt.QtGui import QIcon

from . import child, help_pages, help_text, results, runs
from .definitions import LAYER, OPEN, definitions, help_of, is_hidden, part_outputs
from .finding import HERE
from .inputs import Inputs
from .language import _
from .overlap import check_places
from .refreshing import refresher


class ToolAlgorithm(QgsProcessingAlgorithm):
    def __init__(self, tool: dict[str, Any]) -> None:
        super().__init__()
        self.tool = tool
        self.inputs: Inputs | None = None
        self.made: list[str] = []

    def createInstance(self) -> QgsProcessingAlgorithm:
        return ToolAlgorithm(self.tool)

    def name(self) -> str:
        return self.tool["qgis_id"].partition(":")[2]

    def displayName(self) -> str:
        return self.tool["label"]

    def group(self) -> str:
        return self.tool["group"]

    def groupId(self) -> str:
        return self.tool["group_id"]

    def icon(self) -> QIcon:
        return QIcon(self.svgIconPath())

    def svgIconPath(self) -> str:
        return str(HERE / "icons" / f"{self.groupId()}.svg")

    def tags(self) -> list[str]:
        """Words by which the toolbox's search finds it, in English and in QGIS's language."""
        known = [_("deadwood"), _("log"), _("windthrow"), _("natural hazard"), _("protection forest"), _("rockfall")]
        english = ["deadwood", "log", "windthrow", "natural hazard", "protection forest", "rockfall"]
        return list(dict.fromkeys([*self.tool["name"].split("-"), *english, *known]))

    def shortDescription(self) -> str:
        return self.tool["summary"]

    def shortHelpString(self) -> str:
        """The panel beside the dialog: the tool's description, and the help of each parameter."""
        rows = [
            f"<b>{html.escape(each['label'])}</b>: {html.escape(help_text.labelled(help_of(each), self.tool))}"
            for each in self.tool["parameters"]
            if help_of(each) and not is_hidden(each, self.tool)
        ]
        command = _("On the command line: {command}").format(command=f"deadwood-tool {self.tool['name']}")
        return "".join(f"<p>{each}</p>" for each in [*help_text.paragraphs(self.tool), *rows, command])

    def helpUrl(self) -> str:
        return help_pages.page_of(self.tool)

    def initAlgorithm(self, configuration: dict[str, Any] | None = None) -> None:
        for definition in definitions(self.tool):
            self.addParameter(definition)
        known = {each.name() for each in self.outputDefinitions()}
        for output in part_outputs(self.tool):
            if output.name() not in known:
                self.addOutput(output)

    def checkParameterValues(self, parameters: dict[str, Any], context: QgsProcessingContext) -> tuple[bool, str]:
        """Only missing values: a wrong value is rejected by the tool, with the message of the command line."""
        labels = {each["name"]: each["label"] for each in self.tool["parameters"]}
        for declared in self.tool["parameters"]:
            name, other = declared["name"].upper(), declared["unless"]
            given = [parameters.get(each) for each in (name, name + LAYER, other.upper())]
            if not (declared["required"] or other) or any(value not in (None, "") for value in given):
                continue
            message = _("'{label}' is missing")
            if declared["widget"] == "number_or_layer":
                message = _("'{label}' is missing: a number or a layer")
            if other:
                message = _("'{label}' is missing: a number, a layer, or '{other}'")
            return False, message.format(label=declared["label"], other=labels.get(other, ""))
        return True, ""

    def prepareAlgorithm(
        self, parameters: dict[str, Any], context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> bool:
        """In QGIS's own thread, which owns the layers: make sure that everything the tool reads is in files."""
        child.command()  # fails immediately and explains how to install what is missing
        self.inputs = Inputs(self, parameters, context, feedback)
        self.inputs.collect(self.tool["parameters"])
        check_places(self.inputs, context, feedback)
        return True

    def processAlgorithm(
        self, parameters: dict[str, Any], context: QgsProcessingContext, feedback: QgsProcessingFeedback
    ) -> dict[str, Any]:
        inputs: Inputs = self.inputs  # type: ignore[assignment]  # made by prepareAlgorithm, without which none runs
        try:
            inputs.write_copies(feedback)
            arguments = [self.tool["name"], *inputs.arguments]
            said = child.run(arguments, feedback, lambda line: help_text.labelled(line, self.tool))
        except QgsProcessingException as error:
            if feedback.isCanceled():
                raise QgsProcessingException(inputs.after_cancel()) from None
            raise QgsProcessingException(inputs.in_the_users_words(str(error))) from None
        # in a separate thread the algorithm has a separate context, whose layers replace those of prepare
        for path, details in inputs.to_load.items():
            if path not in context.layersToLoadOnCompletion():
                context.addLayerToLoadOnCompletion(path, details)
        found = results.Results(self.tool, inputs.outputs, said.outputs, said.command)
        opens = self.parameterAsBoolean(parameters, OPEN, context) if self.parameterDefinition(OPEN) else False
        found.load(context, opens)
        self.made = list(inputs.outputs.values())
        names = help_text.output_names(self.tool)
        parts = {names[part]: place for part, place in found.parts()}
        return {**parts, **{name.upper(): path for name, path in inputs.outputs.items()}}

    def postProcessAlgorithm(self, context: QgsProcessingContext, feedback: QgsProcessingFeedback) -> dict[str, Any]:
        """In QGIS's own thread: what the map shows of a result that was replaced."""
        for each in self.made:
            runs.remember(each)
        if context.project() is not None:
            refresher.asked.emit(context.project(), self.made)
        return {}
