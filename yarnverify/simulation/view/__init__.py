"""Pictures of yarns: tubes of their true radius, over and under each other, coloured by what happens in them.

    picture(cloth, Q, "cloth.png", colour="shear")            a still
    movie(cloth, frames, "fall.gif", times=times)             over time; turntable(cloth, Q, "round.gif") from all around
    scene(cloth, frames, "cloth.html", times=times)           to turn and play in a browser, one file
    series = Series(cloth, "cloth.pvd"); series.write(t, Q)   for ParaView, step by step as a run goes

pyvista draws. Where VTK cannot render, ``why_not()`` says so in one line and matplotlib draws the same tubes. Nothing of either
is imported before a picture is made.
"""

from yarnverify.simulation.view.measures import Measure, energy, measure
from yarnverify.simulation.view.pictures import movie, picture, turntable
from yarnverify.simulation.view.probe import why_not
from yarnverify.simulation.view.scene import scene
from yarnverify.simulation.view.series import Series

__all__ = ["Measure", "Series", "energy", "measure", "movie", "picture", "scene", "turntable", "why_not"]
