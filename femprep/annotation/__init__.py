"""Anyone's volume mesh in; its facets and regions named, with how sure each name is, out."""

from femprep.annotation.annotate import annotate
from femprep.annotation.pieces import read_surfaces
from femprep.annotation.records import Annotation

__all__ = ["Annotation", "annotate", "read_surfaces"]
