"""Numbers that several steps of a refinement share."""

from dataclasses import dataclass

from ..geometry.numbers import derived, fitted, measured


@dataclass(frozen=True)
class CurveNumbers:
    """Numbers that several steps share."""

    enough_points: int = measured(4096, "points of an object beyond which its surface hangs together in the same way")
    vertex_points: int = derived(32, "points to a vertex of a tube with 20 around it, and two vertices a radius")
    half_support: int = fitted(8, "points that support a vertex half; an edge has a piece for so many")
    stay: float = fitted(0.1, "weight of staying, per point; of a junction, over that of one line")
    touching: float = fitted(0.25, "radii by which a tangent plane passes the section, where its point counts half")
    undisturbed: float = fitted(
        1.3, "distance from other limbs, over that of their surface, where half a limb is undisturbed"
    )
    line_length: float = fitted(2.0, "radii from there, or from where an end is cut, over which a limb's line is taken")
    heading: float = fitted(3.0, "radii over which it is seen where a curve goes on")
    beside: float = fitted(2.0, "half widths from a curve to where nothing is beside it")
    neck: float = fitted(3.0, "least half width of a wide end over its neck's, and of a body over its handle's")
    stub: float = measured(
        3.3, "length over half width of what is hardly longer than thick; a box like a ball has 2 to 3"
    )
    majority: float = derived(0.5, "share of the points, from which on a cloud is called what they are")
    sheet: float = fitted(0.9, "share of one direction among the normals of a sheet; a tube has .5")
    inside: float = fitted(0.4, "winding number below which an axis is in little: half a tube .5, sparse crowns .2")
    little: float = fitted(0.1, "share, or radii of a length, below which its logarithm says no more")
    unsure: float = fitted(0.4, "confidence below which the normals do not say where the axis is")
    surface_growth: float = measured(2.5, "growth of links on a surface; noise that fills space has more, a curve 1.7")


CURVE = CurveNumbers()
