# SPDX-License-Identifier: GPL-3.0-or-later
"""VTK's importer of glTF, which draws."""

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401, as it brings what draws
from adapter import DEGREES, EYE, PIXELS, TARGET, Task, main, outline
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkIOImport import vtkGLTFImporter
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter


def drawn(path: str, times: list[float], clip: int = 0) -> list[np.ndarray]:
    window, renderer, importer = vtkRenderWindow(), vtkRenderer(), vtkGLTFImporter()
    window.SetOffScreenRendering(True)
    window.SetSize(PIXELS, PIXELS)
    window.SetMultiSamples(0)
    window.AddRenderer(renderer)
    importer.SetRenderWindow(window)
    importer.SetFileName(path)
    importer.Update()
    for number in range(importer.GetNumberOfAnimations()):
        importer.DisableAnimation(number)
    if importer.GetNumberOfAnimations():
        importer.EnableAnimation(clip)
    camera, found = renderer.GetActiveCamera(), []
    camera.SetPosition(EYE)
    camera.SetFocalPoint(TARGET)
    camera.SetViewUp(0.0, 1.0, 0.0)
    camera.SetViewAngle(DEGREES)
    camera.SetParallelProjection(False)
    for time in times:
        importer.UpdateAtTimeValue(time)
        renderer.ResetCameraClippingRange()
        window.Render()
        picture = vtkWindowToImageFilter()
        picture.SetInput(window)
        picture.ReadFrontBufferOff()
        picture.Update()
        values = vtk_to_numpy(picture.GetOutput().GetPointData().GetScalars())
        found.append(outline(values.reshape(PIXELS, PIXELS, -1)[::-1]))
    return found


def play(task: Task) -> dict:
    still = [drawn(path, [0.0])[0] for path in task.still]
    return {"outlines": drawn(str(task.path), task.times, task.clip), "still": still}


if __name__ == "__main__":
    main(vtkVersion.GetVTKVersion(), play)
