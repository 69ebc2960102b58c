"""The toolbox's own environment, which the plugin can make: which Python makes it, and what is installed."""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

from qgis.core import QgsNetworkAccessManager
from qgis.PyQt.QtCore import QUrl
from qgis.PyQt.QtNetwork import QNetworkProxy, QNetworkProxyFactory, QNetworkProxyQuery

from .finding import BIN, DISTRIBUTION, HERE, WINDOWS, read_manifest
from .language import _

OLDEST = (3, 11)
NEWEST = 14  # minor version that is looked for first on the PATH
VERSION_LINE = "import sys; print(*sys.version_info[:3], sys.executable, sep='\\n')"
# Exits with 0 in a Python of an environment that has what pip needs: those of some bundles do not start, or are no
# environment.
STARTS = "import sys, ssl, pip; sys.exit(sys.prefix == sys.base_prefix)"
OUTSIDE = QUrl("https://example.org")  # any address: where the system decides, it is asked for the proxy of one
NETWORK = ("NewConnectionError", "name resolution", "Max retries exceeded", "ProxyError", "getaddrinfo", "timed out")


def python_of(place: Path) -> Path:
    return place / BIN / ("python.exe" if WINDOWS else "python")


def what_to_install(named: str = "") -> list[str]:
    """Words for pip: what the user names, the wheel that came with the plugin, or its version from the user's index."""
    if named:
        return [named]
    wheels = sorted((HERE / "wheels").glob("*.whl"))
    return [str(wheels[-1])] if wheels else [f"{DISTRIBUTION}=={read_manifest()['version']}"]


def candidates(named: str = "") -> list[str]:
    """Programs that may be a Python: the one that the user names, QGIS's own, and those of the PATH."""
    if named:
        return [named]
    prefixes = dict.fromkeys(Path(each) for each in (sys.prefix, sys.base_prefix, sys.exec_prefix))
    names = ("python3.exe", "python.exe") if WINDOWS else ("bin/python3",)
    own = [str(each / name) for each in prefixes for name in names if (each / name).is_file()]
    listed = [f"python3.{minor}" for minor in range(NEWEST, OLDEST[1] - 1, -1)] + ["python3", "python", "py"]
    return list(dict.fromkeys([*own, *(path for name in listed if (path := shutil.which(name)))]))


def suitable(said: str) -> str:
    """The interpreter, from what a program answers to `VERSION_LINE`; empty where it is too old, or none."""
    lines = said.splitlines()
    if len(lines) < 4 or not all(each.isdigit() for each in lines[:3]):
        return ""
    return lines[3] if tuple(map(int, lines[:2])) >= OLDEST else ""


def proxy() -> str:
    """The address of QGIS's proxy (Settings > Options > Network), as pip takes it; empty if there is none."""
    set_in_qgis = QgsNetworkAccessManager.instance().fallbackProxy()
    if set_in_qgis.type() == QNetworkProxy.ProxyType.DefaultProxy:
        set_in_qgis = QNetworkProxyFactory.systemProxyForQuery(QNetworkProxyQuery(OUTSIDE))[0]
    schemes = {
        QNetworkProxy.ProxyType.HttpProxy: "http",
        QNetworkProxy.ProxyType.HttpCachingProxy: "http",
        QNetworkProxy.ProxyType.Socks5Proxy: "socks5h",
    }
    scheme = schemes.get(set_in_qgis.type())
    if scheme is None or not set_in_qgis.hostName():
        return ""
    address = QUrl()
    address.setScheme(scheme)
    address.setHost(set_in_qgis.hostName())
    address.setPort(set_in_qgis.port())
    address.setUserName(set_in_qgis.user())
    address.setPassword(set_in_qgis.password())
    return address.toString(QUrl.ComponentFormattingOption.FullyEncoded)


def remove(place: Path) -> None:
    """Remove an environment made by the plugin, and nothing else."""
    if place.name.startswith(DISTRIBUTION) and place.is_dir():
        shutil.rmtree(place)


def library_of(line: str) -> str:
    """The library in a line of pip's output; empty for other lines."""
    found = re.match(r"\s*(?:Collecting|Downloading|Using cached|Processing|Building wheel for)\s+([^\s;(]+)", line)
    return re.split(r"[=<>!~-]", re.split(r"[/\\]", found[1])[-1])[0] if found else ""


# --- what went wrong, in plain words --------------------------------------------------------------------------------


def too_old(program: str) -> str:
    return _("{python} is not a Python of version 3.11 or newer.").format(python=program)


def no_python(named: str, failures: list[str]) -> str:
    """What to do, after one line for each Python that was tried."""
    if named:
        return failures[0]
    install = _(
        "No Python of version 3.11 or newer was found that can make the environment. Install one (Windows and macOS: "
        "from python.org; Linux: the packages python3 and python3-venv), or name it above, and try again."
    )
    return "\n".join([install, *failures])


def no_environment(python: str, said: str) -> str:
    if "ensurepip" in said or "No module named" in said:
        message = _(
            "{python} has no complete module venv and cannot make an environment. On Debian and Ubuntu install the "
            "package python3-venv; or name another Python above."
        )
        return message.format(python=python)
    return _("{python} cannot make an environment that starts: {why}").format(python=python, why=_last_line(said))


def no_packages(said: str) -> str:
    missing = re.findall(r"No matching distribution found for (\S+)", said)
    if any(each in said for each in NETWORK):
        return _(
            "The package index could not be reached. Check the network and, in an office, the proxy (pip config set "
            "global.proxy ADDRESS), and try again."
        )
    if missing and missing[-1].startswith(DISTRIBUTION):
        message = _(
            "Your package index has no {package}. Use a zip of the plugin that contains it, or name the wheel or the "
            "folder of the toolbox above."
        )
        return message.format(package=missing[-1])
    if missing:
        return _("The package index has no {package} for this Python; name another Python above.").format(
            package=missing[-1]
        )
    if "No space left" in said or "Errno 28" in said:
        return _("The disk is full: the toolbox needs about 1 GB.")
    return _("The libraries could not be installed: {why}").format(why=_last_line(said))


def not_working(said: str) -> str:
    return _("It was installed, but does not work: {why}").format(why=_last_line(said))


def _last_line(said: str) -> str:
    lines = [each.strip() for each in said.splitlines() if each.strip()]
    errors = [each for each in lines if each.lower().startswith("error")]
    return (errors or lines or ["-"])[-1][:300]
