"""Packages that serve one format only: imported when it is asked for, and named when they are missing."""

from __future__ import annotations

from importlib import import_module

from toolkit.errors import MissingDependencyError

__all__ = ["require"]

_PACKAGES = {"usd": ("pxr", "usd-core"), "alembic": ("alembic3d", "alembic3d")}


def require(extra: str, where: object) -> None:
    """Make sure that the package of ``extra`` (``"usd"`` or ``"alembic"``) can be imported.

    Raises
    ------
    MissingDependencyError : it is not installed; the remedy is the command that installs it
    """
    module, package = _PACKAGES[extra]
    try:
        import_module(module)
    except ImportError as error:
        what = f"this format needs the package {package}, which is not installed"
        raise MissingDependencyError(what, where=where, remedy=f"run: pip install 'mien[{extra}]'") from error
