"""A mesh in, a parameter file of openCARP out: a beat from the endocardia, to be run as it is and then changed."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.export.deck.names import facet_names, region_names
from femprep.export.purkinje import PURKINJE
from femprep.model import IntArray, PurkinjeNet, VolumeMesh, endo_tags, is_blood

#: Regions of the wall that conduct no action potential.
VESSELS: Final = ("aorta", "pulmonary_artery")
#: Conductivities within and between cells, along fibres and across them, S/m: Niederer et al. 2011.
INTRA: Final = (0.17, 0.019)
EXTRA: Final = (0.62, 0.24)
#: Junctions whose times differ by less are one stimulus, ms.
STEP: Final = 2.0
#: Of blood, S/m: Gabriel et al. 1996.
BATH: Final = 0.7

_HEAD: Final = """\
# A beat that starts {where}, to start from. In this folder: openCARP +F "{stem}.par"
# Tags: {tags}
# Cell model, conductivities and surface-to-volume ratio: Niederer et al. 2011, doi 10.1098/rsta.2011.0139, who find
# the speed of the front to depend much on the mesh at edges of 0.5 mm, little at 0.1 mm. MeshTool refines this one.
simID    = "{stem}_beat"
meshname = "{stem}"
bidomain = 0
parab_solve = 1
dt      = 20    # microseconds
tend    = 400   # ms, as below
spacedt = 1
timedt  = 10

# Times of activation
num_LATs = 1
lats[0].ID = "activation"
lats[0].measurand = 0
lats[0].all = 0
lats[0].method = 1
lats[0].threshold = -10
"""


def parameters(mesh: VolumeMesh, stem: str) -> str:
    """The text of ``stem.par``: regions with their tags, conductivities, cell model, and stimuli.

    Without fibres the tissue conducts alike in all directions, as it does along fibres.

    References
    ----------
    Niederer et al. 2011, doi 10.1098/rsta.2011.0139 (conductivities, cell model, surface-to-volume ratio);
    Gabriel et al. 1996, doi 10.1088/0031-9155/41/11/003 (blood)
    """
    regions = region_names(mesh)
    blood = [tag for tag in regions.values() if is_blood(tag)]
    wall = [tag for name, tag in regions.items() if name not in VESSELS and tag not in blood]
    tags = ", ".join(f"{tag} {name}" for name, tag in regions.items())
    text = _HEAD.format(
        stem=stem, tags=tags, where="on the endocardia" if mesh.purkinje is None else "in Purkinje fibres"
    )
    text += "\n# Where there are cells, and where there is current outside of them\nnum_phys_regions = 2\n"
    text += 'phys_region[0].name = "intracellular"\nphys_region[0].ptype = 0\n' + _tags("phys_region[0]", wall)
    text += 'phys_region[1].name = "extracellular"\nphys_region[1].ptype = 1\n'
    text += _tags("phys_region[1]", list(regions.values()))
    text += "\nnum_imp_regions = 1\n" + 'imp_region[0].name = "wall"\nimp_region[0].im = tenTusscherPanfilov\n'
    text += "imp_region[0].cellSurfVolRatio = 0.14   # 1/um\n" + _tags("imp_region[0]", wall)
    text += f"\n# S/m\nnum_gregions = {2 if blood else 1}\n" + 'gregion[0].name = "wall"\n'
    text += _tags("gregion[0]", [tag for tag in regions.values() if tag not in blood])
    across = 1 if "fiber" in mesh.cell_data else 0
    for name, values in (("i", INTRA), ("e", EXTRA)):
        for axis, value in zip("ltn", (values[0], values[across], values[across])):
            text += f"gregion[0].g_{name}{axis} = {value}\n"
    if blood:
        text += 'gregion[1].name = "blood"\n' + _tags("gregion[1]", blood)
        text += f"gregion[1].g_bath = {BATH}   # Gabriel et al. 1996\n"
    return text + _stimuli(mesh, stem)


def _tags(of: str, tags: list[int]) -> str:
    return f"{of}.num_IDs = {len(tags)}\n" + "".join(f"{of}.ID[{i}] = {tag}\n" for i, tag in enumerate(tags))


def waves(net: PurkinjeNet) -> dict[str, IntArray]:
    """Junctions by the time at which a beat comes to them, in steps of 2 ms: points of the mesh by name."""
    ends = net.junctions
    step = np.floor(net.arrival[ends] / STEP).astype(np.int64)
    return {f"{PURKINJE}_{int(STEP * k)}": np.unique(net.mesh_point[ends[step == k]]) for k in np.unique(step)}


def _stimuli(mesh: VolumeMesh, stem: str) -> str:
    """A current into the junctions of Purkinje fibres as a beat comes to them; without such fibres, into the nodes of
    each endocardium at once.
    """
    if mesh.purkinje is not None:
        starts = {name: int(name.rpartition("_")[2]) for name in waves(mesh.purkinje)}
        where = "junctions of the Purkinje fibres, as a beat comes to them"
    else:
        starts = {name: 0 for name, tag in facet_names(mesh).items() if tag in endo_tags()}
        where = "nodes of each endocardium"
    text = f"\n# uA/cm2 for 2 ms at the {where}\nnum_stim = {len(starts)}\n"
    for i, (name, start) in enumerate(starts.items()):
        text += f'stim[{i}].name = "{name}"\nstim[{i}].crct.type = 0\nstim[{i}].elec.vtx_file = "{stem}.{name}.vtx"\n'
        text += f"stim[{i}].pulse.strength = 250\nstim[{i}].ptcl.start = {start}\nstim[{i}].ptcl.duration = 2\n"
        text += f"stim[{i}].ptcl.npls = 1\n"
    return text
