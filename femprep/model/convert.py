"""The methods by which a noun becomes an object of another library; the libraries are loaded when one is called."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from femprep.model.immutable import Immutable


def maker(name: str) -> Callable[..., Any]:
    """The function of :mod:`femprep.export.objects` of some name.

    A method is where one looks for it, and what it does belongs to the layer of formats, far above the nouns. So that
    is named here, as the table of formats names its writers, and loaded when the method is called.
    """
    function: Callable[..., Any] = getattr(import_module("femprep.export.objects"), name)
    return function


class Convertible(Immutable):
    """Base of the nouns that other libraries know as well."""

    def to_pyvista(self) -> Any:
        """This as a ``pyvista.PolyData`` or ``UnstructuredGrid``, with its data.

        Examples
        --------
        >>> wall.to_pyvista().cell_data.keys()
        ['facet_tag']
        """
        return maker("to_pyvista")(self)

    def to_meshio(self) -> Any:
        """This as a ``meshio.Mesh``: tags as cell data, their names as field data.

        Examples
        --------
        >>> [block.type for block in mesh.to_meshio().cells]
        ['tetra', 'triangle']
        """
        return maker("to_meshio")(self)

    def plot(self, **keywords: Any) -> Any:
        """Show in a window or a notebook, coloured by tags.

        Parameters
        ----------
        **keywords
            Those of ``pyvista.DataSet.plot``: ``scalars="aha"``, ``off_screen=True``, ``screenshot="heart.png"``.

        Examples
        --------
        >>> mesh.plot(scalars="region")  # doctest: +SKIP
        """
        return maker("plot")(self, **keywords)
