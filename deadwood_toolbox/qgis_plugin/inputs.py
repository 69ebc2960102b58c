"""QGIS's values as arguments of the command: layers of the map become files, and files become what the command line
accepts.

A layer is passed as the file from which it is read, unless the map holds what the file does not: a selection, a
filter, unsaved edits, virtual or joined fields, cells without data, another CRS, or no file at all. Then it is saved
for the tool.
"""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path
from typing import Any

from qgis.core import (
    QgsFeatureRequest,
    QgsMapLayer,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeatureSourceDefinition,
    QgsProcessingFeedback,
    QgsProcessingUtils,
    QgsProperty,
    QgsProviderRegistry,
    QgsRasterLayer,
    QgsVectorLayer,
)

from . import raster_copy, vector_copy
from .definitions import LAYER, is_hidden, proposed
from .language import _

LAYERNAME = "|layername="
# With --fidelity auto, a run also keeps unfinished work in folders with these names (auto_run, a test).
AUTO_KEEPS = (".auto", ".auto-draft", ".auto-standard", ".auto-fine", ".auto-reference")


class Inputs:
    """The words for one start of a tool, and their meaning.

    Attributes
    ----------
    arguments : list of str
        Flags and values.
    outputs : dict
        Declared name of each output -> its path.
    layers : list of (declared parameter, layer or path)
        Every raster and vector input, for the checks before the start.
    """

    def __init__(
        self,
        algorithm: QgsProcessingAlgorithm,
        parameters: dict[str, Any],
        context: QgsProcessingContext,
        feedback: QgsProcessingFeedback,
    ) -> None:
        self.algorithm, self.context, self.feedback = algorithm, context, feedback
        self.parameters = dict(parameters)
        self.arguments: list[str] = []
        self.outputs: dict[str, str] = {}
        self.layers: list[tuple[dict[str, Any], QgsMapLayer | str]] = []
        self.folders: list[str] = []
        self.saved: dict[str, str] = {}  # file made for the tool -> name of its layer
        self.copies: list[tuple[str, raster_copy.Copy]] = []  # names of layers, and what must be written of them
        self.layer_copies: list[tuple[str, vector_copy.Copy]] = []
        self.crs_of_map = ""
        self.to_load: dict[str, QgsProcessingContext.LayerDetails] = {}  # by path, the files that the user wants opened

    def collect(self, declared: list[dict[str, Any]]) -> None:
        message = {"parameters": declared}
        for each in declared:
            for old in each["old_names"]:  # from a model or script made for the previous version
                if old.upper() in self.parameters:
                    self.parameters.setdefault(each["name"].upper(), self.parameters[old.upper()])
            if is_hidden(each, message):
                self.arguments.append("--overwrite")  # QGIS has asked already
            else:
                self._add(each)
        self.to_load = dict(self.context.layersToLoadOnCompletion())
        has_crs = any(each.startswith("--crs=") for each in self.arguments)
        if self.crs_of_map and not has_crs and any(each["name"] == "crs" for each in declared):
            self.arguments.append(f"--crs={self.crs_of_map}")

    def in_the_users_words(self, message: str) -> str:
        """The tool's message with layer names instead of the files made from them."""
        for path, name in self.saved.items():
            message = message.replace(path, _("layer '{name}'").format(name=name))
        return message

    def after_cancel(self) -> str:
        """Remove what slide-logs keeps for --resume, unless the user has chosen to resume; returns the message."""
        if "--resume" in self.arguments:
            return _("Canceled; what was finished is kept, and the same run can be continued")
        for folder in self.folders:
            place = Path(folder).absolute()
            for kept in ("", *AUTO_KEEPS):
                shutil.rmtree(place.parent / f".{place.name}{kept}.part", ignore_errors=True)
        return _("Canceled; nothing was left behind")

    def _add(self, declared: dict[str, Any]) -> None:
        flag, name = declared["flag"], declared["name"].upper()
        if declared["widget"] == "flag":
            if self.algorithm.parameterAsBoolean(self.parameters, name, self.context):
                self.arguments.append(flag)
            return
        value = self._output(declared, name) if declared["direction"] == "output" else self._input(declared, name)
        if value:
            self.arguments.append(f"{flag}={value}")

    def _output(self, declared: dict[str, Any], name: str) -> str:
        if declared["widget"] in ("output_raster", "output_vector"):
            path = self.algorithm.parameterAsOutputLayer(self.parameters, name, self.context)
        else:
            path = self.algorithm.parameterAsFileOutput(self.parameters, name, self.context)
        if not path:
            return ""
        if re.match(r"^[a-zA-Z]{2,}:", path):
            message = _("{label}: {path} is not a file; name a separate file")
            raise QgsProcessingException(message.format(label=declared["label"], path=path))
        if not os.path.splitext(path)[1]:
            path += declared["ending"]
        self.outputs[declared["name"]] = path = os.path.abspath(path)
        if declared["widget"] == "output_folder":
            self.folders.append(path)
        return path

    def _input(self, declared: dict[str, Any], name: str) -> str:
        widget = declared["widget"]
        if widget == "number_or_layer":
            return self._number_or_layer(declared, name)
        if widget in ("raster", "vector", "table"):
            return self._layer(declared, self.parameters.get(name))
        if widget == "crs":
            crs = self.algorithm.parameterAsCrs(self.parameters, name, self.context)
            return (crs.authid() or crs.toWkt()) if crs.isValid() else ""
        if widget in ("folder", "file"):
            path = self.algorithm.parameterAsFile(self.parameters, name, self.context)
            return os.path.abspath(path) if path else ""
        return self._plain(declared, name)

    def _plain(self, declared: dict[str, Any], name: str) -> str:
        """Numbers and words, unchanged if possible: the tool's own message is the clearest about a wrong one."""
        default = declared["default"]
        value = self.parameters.get(name, proposed(declared))
        if isinstance(value, QgsProperty):
            value = value.valueAsString(self.context.expressionContext())[0]
        if declared["widget"] == "choice" and isinstance(value, int):
            value = self.algorithm.parameterAsEnumString(self.parameters, name, self.context)
        if value is None or value == "" or value == default:
            return ""
        if isinstance(value, (list, tuple)):
            value = ",".join(each_place(value))
        if declared["widget"] == "integer" and isinstance(value, float) and value.is_integer():
            return str(int(value))
        return repr(value) if isinstance(value, float) else str(value)

    def _number_or_layer(self, declared: dict[str, Any], name: str) -> str:
        number, layer = self.parameters.get(name), self.parameters.get(name + LAYER)
        if layer in (None, ""):
            return self._plain(declared, name)
        if number not in (None, "", declared["default"]) and str(number) != str(declared["default"]):
            message = _("{label}: a number ({number}) and a layer are given; clear one of them")
            raise QgsProcessingException(message.format(label=declared["label"], number=number))
        return self._layer(declared, layer)

    # --- layers ----------------------------------------------------------------------------------------------------

    def _layer(self, declared: dict[str, Any], value: Any) -> str:
        """The file of a layer, made for the tool if the map holds more than the file."""
        selected, limit, condition = False, -1, ""
        if isinstance(value, QgsProcessingFeatureSourceDefinition):
            selected, limit = value.selectedFeaturesOnly, value.featureLimit
            condition = getattr(value, "filterExpression", "")  # from 3.32 on
            value = value.source
        if isinstance(value, QgsProperty):
            value = value.valueAsString(self.context.expressionContext())[0]
        if value is None or value == "":
            return ""
        more = selected or limit > 0 or bool(condition)
        layer = value if isinstance(value, QgsMapLayer) else self._loaded(str(value), load=more)
        if layer is None:
            path, _bar, rest = str(value).partition("|")
            path = os.path.abspath(path) + (f"|{rest}" if rest else "")
            self.layers.append((declared, path))
            return path
        self.layers.append((declared, layer))
        if isinstance(layer, QgsRasterLayer):
            return self._raster(declared, layer)
        if not isinstance(layer, QgsVectorLayer):
            message = _("{label}: '{layer}' is neither a raster nor a vector layer")
            raise QgsProcessingException(message.format(label=declared["label"], layer=layer.name()))
        path = _file_of(layer)
        why = _held_by_the_map(layer, path)
        if not more and not why:
            return path
        request = QgsFeatureRequest()
        if selected:
            request.setFilterFids(layer.selectedFeatureIds())
            why.append(_("{n} selected features").format(n=layer.selectedFeatureCount()))
            if not layer.selectedFeatureCount():
                message = _(
                    "{label}: 'Selected features only' is ticked, but in the layer '{layer}' nothing is selected"
                )
                raise QgsProcessingException(message.format(label=declared["label"], layer=layer.name()))
        if condition:
            request.setFilterExpression(condition)
            why.append(_("a filter"))
        if limit > 0:
            request.setLimit(limit)
            why.append(_("the first {n} features").format(n=limit))
        return self._save(layer, request, why, part=more or bool(layer.subsetString()))

    def _loaded(self, value: str, *, load: bool) -> QgsMapLayer | None:
        """The layer of the map that a text names (id, name or source); a path is loaded only if necessary."""
        options = [each for each in value.split("|")[1:] if not each.startswith("layername=")]
        return QgsProcessingUtils.mapLayerFromString(value, self.context, load or bool(options))

    def _raster(self, declared: dict[str, Any], layer: QgsRasterLayer) -> str:
        decoded = QgsProviderRegistry.instance().decodeUri(layer.providerType(), layer.source())
        path = decoded.get("path", "")
        if layer.providerType() != "gdal" or not os.path.isfile(path):
            return self._save_raster(declared, layer, [_its_source(layer)])
        why = raster_copy.held_by_the_map(layer, path)
        if why:
            return self._save_raster(declared, layer, why)
        if layer.crs().isValid() and not QgsRasterLayer(path, "own").crs().isValid():
            self.crs_of_map = layer.crs().authid() or layer.crs().toWkt()
        return os.path.abspath(path)

    def _save_raster(self, declared: dict[str, Any], layer: QgsRasterLayer, why: list[str]) -> str:
        """A file of the raster for the tool: at once where it can be a virtual one, else written by `write_copies`."""
        provider, name = layer.dataProvider(), _plain_name(layer)
        if provider is None or not provider.xSize() or not provider.ySize():
            message = _("{label}: the layer '{layer}' is not in a file; save it as GeoTIFF first (Export > Save As)")
            raise QgsProcessingException(message.format(label=declared["label"], layer=layer.name()))
        path = QgsProcessingUtils.generateTempFilename(f"{name}.vrt")
        if layer.providerType() != "gdal" or not raster_copy.view(layer, path):
            path = QgsProcessingUtils.generateTempFilename(f"{name}.tif")
            self.copies.append((layer.name(), raster_copy.copy_of(layer, path)))
        self._tell_saved(layer, path, why)
        return path

    def write_copies(self, feedback: QgsProcessingFeedback) -> None:
        """Write layers, and what cannot be a virtual raster, in the thread that waits for the tool."""
        for name, layer in self.layer_copies:
            if why := layer.write(feedback):
                message = _("The layer '{layer}' could not be saved for the tool: {why}")
                raise QgsProcessingException(message.format(layer=name, why=why))
        for name, copy in self.copies:
            feedback.pushInfo(_("{layer}: being saved").format(layer=name))
            if not copy.write(feedback):
                raise QgsProcessingException(_("{layer}: could not be saved").format(layer=name))

    def _tell_saved(self, layer: QgsMapLayer, path: str, why: list[str]) -> None:
        self.saved[path] = layer.name()
        message = _("{layer}: saved for the tool, because of {reasons}")
        self.feedback.pushInfo(message.format(layer=layer.name(), reasons=", ".join(why)))

    def _save(self, layer: QgsVectorLayer, request: QgsFeatureRequest, why: list[str], *, part: bool) -> str:
        name = _plain_name(layer)
        path = QgsProcessingUtils.generateTempFilename(f"{name}.gpkg")
        file = _file_of(layer) if layer.subsetString() else ""
        transforms = self.context.transformContext()
        made = vector_copy.copy_of(layer, request, transforms, part=part, file=file, name=name, path=path)
        self.layer_copies.append((layer.name(), made))
        self._tell_saved(layer, path, why)
        return path


def each_place(value: Any) -> list[str]:
    """The parts of a text separated by commas, or of a list, also of lists, as models make them; parts that do not
    exist but do together are one place, whose name contains a comma.
    """
    if isinstance(value, (list, tuple)):
        return [place for each in value for place in each_place(each)]
    parts, found = ("" if value is None else str(value)).split(","), []
    while parts:
        ends = range(1, len(parts) + 1)
        end = next((end for end in ends if os.path.exists(",".join(parts[:end]).strip())), 1)
        found.append(",".join(parts[:end]).strip())
        parts = parts[end:]
    return [each for each in found if each]


def _file_of(layer: QgsVectorLayer) -> str:
    """The file of a layer as the command line names it; empty if it is in none."""
    if layer.providerType() != "ogr":
        return ""
    decoded = QgsProviderRegistry.instance().decodeUri("ogr", layer.source())
    path, inner = decoded.get("path", ""), decoded.get("layerName")
    if not os.path.exists(path):
        return ""
    return os.path.abspath(path) + (f"{LAYERNAME}{inner}" if inner else "")


def _held_by_the_map(layer: QgsVectorLayer, path: str) -> list[str]:
    """Properties of a layer that are not in its file."""
    if not path:
        return [_its_source(layer)]
    why = []
    if layer.subsetString():
        why.append(_("its filter"))
    if layer.isEditable() and layer.isModified():
        why.append(_("unsaved edits"))
    fields = layer.fields()
    origins = {fields.fieldOrigin(k) for k in range(fields.count())}
    if len(origins) > 1:
        why.append(_("virtual or joined fields"))
    if QgsVectorLayer(path, "own", "ogr").crs() != layer.crs():
        why.append(_("its CRS, which the map has set"))
    return why


def _its_source(layer: QgsMapLayer) -> str:
    return _("its source ({provider})").format(provider=layer.providerType())


def _plain_name(layer: QgsMapLayer) -> str:
    return re.sub(r"[^A-Za-z0-9_-]+", "_", layer.name())[:40].strip("_") or "layer"
