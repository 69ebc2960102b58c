"""Run by QGIS's own Python: the list of folders in a row of the batch table, and in a step of the Model Designer."""

from __future__ import annotations

import json
import os
import sys
from typing import Any

from qgis.core import (
    QgsApplication,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingModelAlgorithm,
    QgsProcessingModelChildAlgorithm,
    QgsProcessingModelChildParameterSource,
    QgsProcessingModelParameter,
    QgsProcessingParameterFile,
    QgsProject,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QTimer
from qgis.PyQt.QtWidgets import QApplication, QComboBox, QLabel, QLineEdit, QListWidget, QPushButton, QToolButton

PLUGINS, WORK = sys.argv[1:3]
application = QgsApplication([], True)
application.initQgis()
sys.path.insert(0, PLUGINS)
sys.path.append(os.path.join(application.pkgDataPath(), "python", "plugins"))
import deadwood  # noqa: E402

plugin = deadwood.classFactory(None)
plugin.initProcessing()
from processing.core.Processing import Processing  # noqa: E402

Processing.initialize()
from processing.gui.BatchAlgorithmDialog import BatchAlgorithmDialog  # noqa: E402
from processing.modeler.ModelerParametersDialog import ModelerParametersDialog  # noqa: E402

Source = QgsProcessingModelChildParameterSource
registry = QgsApplication.processingRegistry()
compare = registry.createAlgorithmById("deadwood:comparescenarios")
told: dict[str, Any] = {}

# --- batch: two rows, of which one is filled by the list -------------------------------------------------------------

batch = BatchAlgorithmDialog(compare.create())
panel = batch.mainWidget()
column = panel.parameter_to_column["RUNS"]
panel.addRow(max(0, 2 - panel.batchRowCount()))
cells = [panel.tblParameters.cellWidget(row + 1, column) for row in range(2)]


def fill_list() -> None:
    """What a user does in the list that the button opens: selects two folders, reverses their order, confirms."""
    asked = QApplication.activeModalWidget()
    rows = asked.findChild(QListWidget, "deadwoodFolders").parent()
    told["begins_with"] = rows.values()
    rows.add("/runs/two")
    rows.places.item(1).setSelected(True)
    next(each for each in rows.findChildren(QPushButton) if each.text() == "Move up").click()
    asked.accept()


cells[0].findChild(QLineEdit, "deadwoodFoldersText").setText("/runs/one")
QTimer.singleShot(300, fill_list)
cells[0].findChild(QToolButton, "deadwoodFoldersButton").click()
told["batch"] = [panel.valueForParameter(row, "RUNS") for row in range(2)]
panel.wrappers[1][column].setParameterValue(panel.valueForParameter(0, "RUNS"), QgsProcessingContext())
told["filled_down"] = panel.valueForParameter(1, "RUNS")
batch.grab().save(f"{WORK}/batch.png")

# --- a model: a step compares a run of the step before with a folder that the model is given --------------------

model = QgsProcessingModelAlgorithm("Two runs", "Deadwood")
behaviour = QgsProcessingParameterFile.Behavior.Folder
for name, label in (("other", "The other run"), ("out", "Where to")):
    given = QgsProcessingParameterFile(name, label, behavior=behaviour)
    model.addModelParameter(given, QgsProcessingModelParameter(name))
first = QgsProcessingModelChildAlgorithm("deadwood:slidelogs")
first.setChildId("slide")
first.setDescription("Slide logs")
model.addChildAlgorithm(first)
dialog = ModelerParametersDialog(compare.create(), model)
panel = dialog.widget.widget
rows = panel.wrappers["RUNS"].rows
menu = rows.findChild(QPushButton, "deadwoodFromModel").menu()
told["offered"] = [each.text() for each in menu.actions()]
for wanted in ("The other run", "'Folder of the run' from algorithm 'Slide logs'"):
    for each in menu.actions():
        if each.text() == wanted:
            each.trigger()
rows.add("/runs/a third")
told["step"] = [rows.places.item(k).text() for k in range(rows.places.count())]
dialog.resize(700, 500)
dialog.show()
QApplication.processEvents()
dialog.grab().save(f"{WORK}/step.png")
step = panel.createAlgorithm()


def plainly(sources: list[Any]) -> list[str]:
    kinds = {
        Source.Source.ModelParameter: lambda each: f"input {each.parameterName()}",
        Source.Source.ChildOutput: lambda each: f"{each.outputChildId()}.{each.outputName()}",
        Source.Source.StaticValue: lambda each: str(each.staticValue()),
    }
    return [kinds[each.source()](each) for each in sources]


told["sources"] = plainly(step.parameterSources()["RUNS"])
model.addChildAlgorithm(step)
again = ModelerParametersDialog(compare.create(), model, step.childId())
told["again"] = plainly(again.widget.widget.wrappers["RUNS"].value())

# --- such a model runs -----------------------------------------------------------------------------------------------

runs = QgsProcessingModelAlgorithm("Compare", "Deadwood")
for name in ("one", "other"):
    given = QgsProcessingParameterFile(name, name, behavior=behaviour)
    runs.addModelParameter(given, QgsProcessingModelParameter(name))
dialog = ModelerParametersDialog(compare.create(), runs)
panel = dialog.widget.widget
for each in panel.wrappers["RUNS"].rows.findChild(QPushButton, "deadwoodFromModel").menu().actions():
    each.trigger()
step = panel.createAlgorithm()
step.addParameterSources("OUTPUT", [Source.fromStaticValue(f"{WORK}/compared")])
runs.addChildAlgorithm(step)


class Feedback(QgsProcessingFeedback):
    said: list[str] = []  # noqa: RUF012 (one object)

    def reportError(self, error: str, fatalError: bool = False) -> None:
        self.said.append(error)


context, feedback = QgsProcessingContext(), Feedback(False)
context.setProject(QgsProject.instance())
_results, told["ran"] = runs.create().run({"one": f"{WORK}/one", "other": f"{WORK}/other"}, context, feedback)
told["said"] = feedback.said

# --- one run: those of the project and the recent ones are offered, any other folder is judged -----------------------

from deadwood import runs as known_runs  # noqa: E402
from deadwood.inputs import each_place  # noqa: E402
from processing.gui.AlgorithmDialog import AlgorithmDialog  # noqa: E402

known_runs.remember(f"{WORK}/other")
known_runs.remember(f"{WORK}/compared")  # no run, but remembered
layer = QgsVectorLayer(f"{WORK}/one/run.gpkg|layername=deposits", "Deposits", "ogr")
QgsProject.instance().addMapLayer(layer)
dialog = AlgorithmDialog(registry.createAlgorithmById("deadwood:counthits"))
wrapper = dialog.mainWidget().wrappers["RUN"]
box, said = (wrapper.widget.findChild(*each) for each in ((QComboBox, "deadwoodRun"), (QLabel, "deadwoodRunSaid")))
told["runs"] = [box.itemText(k) for k in range(box.count())]
told["proposed"] = wrapper.value()
told["judged"] = []
for place in (f"{WORK}/one", WORK, f"{WORK}/nowhere"):
    wrapper.setValue(place)
    told["judged"].append([wrapper.value(), said.text()])
dialog.grab().save(f"{WORK}/run.png")
dialog = AlgorithmDialog(compare.create())
rows = dialog.mainWidget().wrappers["RUNS"].rows
told["offered_runs"] = [each.text() for each in rows.findChild(QPushButton, "deadwoodRuns").menu().actions()]
for each in rows.findChild(QPushButton, "deadwoodRuns").menu().actions():
    each.trigger()
rows.add(f"{WORK}/a, b")
value = dialog.mainWidget().wrappers["RUNS"].value()
told["commas"] = [value, each_place(value), rows.said.text()]
_results, told["ran_with_comma"] = compare.create().run({"RUNS": value, "OUTPUT": f"{WORK}/c"}, context, feedback)
told["said"] = feedback.said
print("JSON" + json.dumps(told), flush=True)
os._exit(0)
