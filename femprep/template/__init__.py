"""Numbers of vertices in, pre-meshed unit spheres out, kept on disk once made."""

from femprep.template.charges import charge_template, sphere_points
from femprep.template.cubed import cubed_sphere, cubed_template
from femprep.template.sphere import Template

__all__ = ["Template", "charge_template", "cubed_sphere", "cubed_template", "sphere_points"]
