"""What femprep's methods rest on: each reference once, with its DOI, and as BibTeX."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final


@dataclass(frozen=True)
class Reference:
    """One entry of the bibliography.

    Attributes
    ----------
    short : str
        Authors and year, as in running text.
    kind : str
        BibTeX's type of entry.
    author : str
        As BibTeX has it: names joined by ``and``.
    title : str
    year : int, optional
    doi : str
        Empty for what has none.
    venue : str
        Journal of an article, proceedings of a paper.
    more : tuple of (str, str)
        Further fields: volume, number, pages, url...
    """

    short: str
    kind: str
    author: str
    title: str
    year: int | None
    doi: str
    venue: str = ""
    more: tuple[tuple[str, str], ...] = ()

    def bibtex(self, key: str) -> str:
        """The entry under a key."""
        place = {"article": "journal", "inproceedings": "booktitle"}.get(self.kind)
        fields = [("author", self.author), ("title", f"{{{self.title}}}")]
        fields += [("year", str(self.year))] if self.year else []
        fields += [(place, self.venue)] if place and self.venue else []
        fields += [*self.more, *([("doi", self.doi)] if self.doi else [])]
        return f"@{self.kind}{{{key},\n" + "".join(f"  {name} = {{{value}}},\n" for name, value in fields) + "}\n"


def _article(short: str, author: str, title: str, journal: str, year: int, doi: str, **more: str) -> Reference:
    return Reference(short, "article", author, title, year, doi, journal, tuple(more.items()))


#: All references by key.
REFERENCES: Final = MappingProxyType(
    {
        "skrinjar2009": _article(
            "Skrinjar and Bistoquet 2009",
            "Skrinjar, Oskar and Bistoquet, Arnaud",
            "Generation of Myocardial Wall Surface Meshes from Segmented {MRI}",
            "International Journal of Biomedical Imaging",
            2009,
            "10.1155/2009/313517",
            volume="2009",
            pages="313517",
        ),
        "wahba1985": _article(
            "Wahba 1985",
            "Wahba, Grace",
            "A Comparison of {GCV} and {GML} for Choosing the Smoothing Parameter in the Generalized Spline Smoothing "
            "Problem",
            "The Annals of Statistics",
            1985,
            "10.1214/aos/1176349743",
            volume="13",
            number="4",
        ),
        "raya1990": _article(
            "Raya and Udupa 1990",
            "Raya, S. P. and Udupa, J. K.",
            "Shape-Based Interpolation of Multidimensional Objects",
            "IEEE Transactions on Medical Imaging",
            1990,
            "10.1109/42.52980",
            volume="9",
            number="1",
        ),
        "mackay1992": _article(
            "MacKay 1992",
            "MacKay, David J. C.",
            "Bayesian Interpolation",
            "Neural Computation",
            1992,
            "10.1162/neco.1992.4.3.415",
            volume="4",
            number="3",
        ),
        "kazhdan2012": _article(
            "Kazhdan et al. 2012",
            "Kazhdan, Michael and Solomon, Jake and Ben-Chen, Mirela",
            "Can Mean-Curvature Flow be Modified to be Non-singular?",
            "Computer Graphics Forum",
            2012,
            "10.1111/j.1467-8659.2012.03179.x",
            volume="31",
            number="5",
        ),
        "glasser1992": _article(
            "Glasser and Every 1992",
            "Glasser, L. and Every, A. G.",
            "Energies and spacings of point charges on a sphere",
            "Journal of Physics A: Mathematical and General",
            1992,
            "10.1088/0305-4470/25/9/020",
            volume="25",
            number="9",
        ),
        "ronchi1996": _article(
            "Ronchi et al. 1996",
            "Ronchi, C. and Iacono, R. and Paolucci, P. S.",
            "The ``Cubed Sphere'': A New Method for the Solution of Partial Differential Equations in Spherical "
            "Geometry",
            "Journal of Computational Physics",
            1996,
            "10.1006/jcph.1996.0047",
            volume="124",
            number="1",
        ),
        "lange1989": _article(
            "Lange et al. 1989",
            "Lange, Kenneth L. and Little, Roderick J. A. and Taylor, Jeremy M. G.",
            "Robust Statistical Modeling Using the $t$ Distribution",
            "Journal of the American Statistical Association",
            1989,
            "10.1080/01621459.1989.10478852",
            volume="84",
        ),
        "hu2020": _article(
            "Hu et al. 2020",
            "Hu, Yixin and Schneider, Teseo and Wang, Bolun and Zorin, Denis and Panozzo, Daniele",
            "Fast Tetrahedral Meshing in the Wild",
            "ACM Transactions on Graphics",
            2020,
            "10.1145/3386569.3392385",
            volume="39",
            number="4",
        ),
        "bey1995": _article(
            "Bey 1995",
            "Bey, J.",
            "Tetrahedral Grid Refinement",
            "Computing",
            1995,
            "10.1007/BF02238487",
            volume="55",
            pages="355--378",
        ),
        "freitag1997": _article(
            "Freitag and Ollivier-Gooch 1997",
            "Freitag, Lori A. and Ollivier-Gooch, Carl",
            "Tetrahedral Mesh Improvement Using Swapping and Smoothing",
            "International Journal for Numerical Methods in Engineering",
            1997,
            "10.1002/(SICI)1097-0207(19971115)40:21<3979::AID-NME251>3.0.CO;2-9",
            volume="40",
            number="21",
        ),
        "knupp2001": _article(
            "Knupp 2001",
            "Knupp, Patrick M.",
            "Algebraic Mesh Quality Metrics",
            "SIAM Journal on Scientific Computing",
            2001,
            "10.1137/S1064827500371499",
            volume="23",
            number="1",
        ),
        "escobar2003": _article(
            "Escobar et al. 2003",
            "Escobar, J. M. and Rodr{\\'i}guez, E. and Montenegro, R. and Montero, G. and Gonz{\\'a}lez-Yuste, J. M.",
            "Simultaneous Untangling and Smoothing of Tetrahedral Meshes",
            "Computer Methods in Applied Mechanics and Engineering",
            2003,
            "10.1016/S0045-7825(03)00299-8",
            volume="192",
        ),
        "schuler2021": _article(
            "Schuler et al. 2021",
            "Schuler, Steffen and Pilia, Nicolas and Potyagaylo, Danila and Loewe, Axel",
            "Cobiveco: Consistent biventricular coordinates for precise and intuitive description of position in the "
            "heart -- with {MATLAB} implementation",
            "Medical Image Analysis",
            2021,
            "10.1016/j.media.2021.102247",
            volume="74",
            pages="102247",
        ),
        "cerqueira2002": _article(
            "Cerqueira et al. 2002",
            "Cerqueira, Manuel D. and Weissman, Neil J. and Dilsizian, Vasken and Jacobs, Alice K. and "
            "Kaul, Sanjiv and Laskey, Warren K. and Pennell, Dudley J. and Rumberger, John A. and "
            "Ryan, Thomas and Verani, Mario S.",
            "Standardized Myocardial Segmentation and Nomenclature for Tomographic Imaging of the Heart",
            "Circulation",
            2002,
            "10.1161/hc0402.102975",
            volume="105",
            number="4",
        ),
        "bayer2012": _article(
            "Bayer et al. 2012",
            "Bayer, J. D. and Blake, R. C. and Plank, G. and Trayanova, N. A.",
            "A Novel Rule-Based Algorithm for Assigning Myocardial Fiber Orientation to Computational Heart Models",
            "Annals of Biomedical Engineering",
            2012,
            "10.1007/s10439-012-0593-5",
            volume="40",
            number="10",
        ),
        "strocchi2020": _article(
            "Strocchi et al. 2020",
            "Strocchi, Marina and Gsell, Matthias A. F. and Augustin, Christoph M. and Razeghi, Orod and "
            "Roney, Caroline H. and Prassl, Anton J. and Vigmond, Edward J. and Behar, Jonathan M. and "
            "Gould, Justin S. and Rinaldi, Christopher A. and Bishop, Martin J. and Plank, Gernot and "
            "Niederer, Steven A.",
            "Simulating Ventricular Systolic Motion in a Four-Chamber Heart Model with Spatially Varying {Robin} "
            "Boundary Conditions to Model the Effect of the Pericardium",
            "Journal of Biomechanics",
            2020,
            "10.1016/j.jbiomech.2020.109645",
            volume="101",
            pages="109645",
        ),
        "costabal2016": _article(
            "Sahli Costabal et al. 2016",
            "Sahli Costabal, Francisco and Hurtado, Daniel E. and Kuhl, Ellen",
            "Generating {Purkinje} networks in the human heart",
            "Journal of Biomechanics",
            2016,
            "10.1016/j.jbiomech.2015.12.025",
            volume="49",
            number="12",
        ),
        "fu2013": _article(
            "Fu et al. 2013",
            "Fu, Zhisong and Kirby, Robert M. and Whitaker, Ross T.",
            "A Fast Iterative Method for Solving the Eikonal Equation on Tetrahedral Domains",
            "SIAM Journal on Scientific Computing",
            2013,
            "10.1137/120881956",
            volume="35",
            number="5",
        ),
        "caldwell2009": _article(
            "Caldwell et al. 2009",
            "Caldwell, Bryan J. and Trew, Mark L. and Sands, Gregory B. and Hooks, Darren A. and LeGrice, Ian J. and "
            "Smaill, Bruce H.",
            "Three Distinct Directions of Intramural Activation Reveal Nonuniform Side-to-Side Electrical Coupling of "
            "Ventricular Myocytes",
            "Circulation: Arrhythmia and Electrophysiology",
            2009,
            "10.1161/CIRCEP.108.830133",
            volume="2",
            number="4",
        ),
        "doste2019": _article(
            "Doste et al. 2019",
            "Doste, Ruben and Soto-Iglesias, David and Bernardino, Gabriel and Alcaine, Alejandro and "
            "Sebastian, Rafael and Giffard-Roisin, Sophie and Sermesant, Maxime and Berruezo, Antonio and "
            "Sanchez-Quintana, Damian and Camara, Oscar",
            "A Rule-Based Method to Model Myocardial Fiber Orientation in Cardiac Biventricular Geometries with "
            "Outflow Tracts",
            "International Journal for Numerical Methods in Biomedical Engineering",
            2019,
            "10.1002/cnm.3185",
            volume="35",
            number="4",
        ),
        "piersanti2021": _article(
            "Piersanti et al. 2021",
            "Piersanti, Roberto and Africa, Pasquale C. and Fedele, Marco and Vergara, Christian and Ded{\\`e}, Luca "
            "and Corno, Antonio F. and Quarteroni, Alfio",
            "Modeling Cardiac Muscle Fibers in Ventricular and Atrial Electrophysiology Simulations",
            "Computer Methods in Applied Mechanics and Engineering",
            2021,
            "10.1016/j.cma.2020.113468",
            volume="373",
        ),
        "streeter1969": _article(
            "Streeter et al. 1969",
            "Streeter, D. D. and Spotnitz, H. M. and Patel, D. P. and Ross, J. and Sonnenblick, E. H.",
            "Fiber Orientation in the Canine Left Ventricle during Diastole and Systole",
            "Circulation Research",
            1969,
            "10.1161/01.RES.24.3.339",
            volume="24",
            number="3",
        ),
        "quilez": Reference(
            "Quilez",
            "misc",
            "Quilez, Inigo",
            "Smooth minimum",
            None,
            "",
            "",
            (("howpublished", "\\url{https://iquilezles.org/articles/smin}"),),
        ),
    }
)


def bibtex(keys: Iterable[str]) -> str:
    """The entries of some keys, in their order."""
    return "\n".join(REFERENCES[key].bibtex(key) for key in keys)
