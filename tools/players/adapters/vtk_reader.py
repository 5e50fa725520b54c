# SPDX-License-Identifier: GPL-3.0-or-later
"""VTK's reader of glTF, which skins on the processor."""

import numpy as np
from adapter import NoSkinError, Task, main, z_up
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkIOGeometry import vtkGLTFReader


def points_of(reader: vtkGLTFReader) -> np.ndarray:
    blocks = reader.GetOutput().NewIterator()
    found = []
    blocks.InitTraversal()
    while not blocks.IsDoneWithTraversal():
        found.append(vtk_to_numpy(blocks.GetCurrentDataObject().GetPoints().GetData()).copy())
        blocks.GoToNextItem()
    return z_up(np.concatenate(found))


def reader_of(task: Task) -> vtkGLTFReader:
    reader = vtkGLTFReader()
    reader.SetFileName(str(task.path))
    reader.UpdateInformation()
    return reader


def play(task: Task) -> dict:
    still, reader = reader_of(task), reader_of(task)
    still.SetApplyDeformationsToGeometry(False)
    still.Update()
    if not still.GetOutput().GetNumberOfPoints():
        raise NoSkinError("reads no mesh")
    reader.SetFrameRate(30)
    for number in range(reader.GetNumberOfAnimations()):
        reader.DisableAnimation(number)
    reader.EnableAnimation(task.clip)
    points = []
    for time in task.times:
        reader.UpdateTimeStep(time)
        points.append(points_of(reader))
    return {"rest": points_of(still), "points": points}


if __name__ == "__main__":
    main(vtkVersion.GetVTKVersion(), play)
