"""Numbers of vertices in, pre-meshed unit spheres out, kept on disk once made."""

from femprep.template.charges import charge_template, sphere_points
from femprep.template.sphere import Template

__all__ = ["Template", "charge_template", "sphere_points"]
