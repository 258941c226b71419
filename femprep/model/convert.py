"""The methods by which a noun becomes an object of another library; the libraries are loaded when one is called."""

from __future__ import annotations

from typing import Any


class Convertible:
    """Base of the nouns that other libraries know as well.

    What the methods do stands in :mod:`femprep.export.objects`, a layer above, which they load when called: a method is
    where one looks for it. It is the one import of the model's that runs upwards.
    """

    def to_pyvista(self) -> Any:
        """This as a ``pyvista.PolyData`` or ``UnstructuredGrid``, with its data.

        Examples
        --------
        >>> wall.to_pyvista().cell_data.keys()
        ['facet_tag']
        """
        from femprep.export import objects

        return objects.to_pyvista(self)  # type: ignore[arg-type]

    def to_meshio(self) -> Any:
        """This as a ``meshio.Mesh``: tags as cell data, their names as field data.

        Examples
        --------
        >>> [block.type for block in mesh.to_meshio().cells]
        ['tetra', 'triangle']
        """
        from femprep.export import objects

        return objects.to_meshio(self)  # type: ignore[arg-type]

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
        from femprep.export import objects

        return objects.plot(self, **keywords)  # type: ignore[arg-type]
