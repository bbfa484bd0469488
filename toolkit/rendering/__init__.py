"""Pictures of meshes without a display: camera, renderer, colour maps, sheets and videos.

Everything runs on the CPU in this process, so a frame looks the same on a workstation, in a container and in a test.
"""

from toolkit.rendering.camera import Camera
from toolkit.rendering.colormap import ColorScale, add_legend
from toolkit.rendering.overlay import Lines, Markers
from toolkit.rendering.renderer import Renderer
from toolkit.rendering.shading import BONE, CLAY, IVORY, SKIN, Lighting, Material
from toolkit.rendering.sheet import Row, contact_sheet, side_by_side
from toolkit.rendering.video import write_video

__all__ = [
    "BONE",
    "CLAY",
    "IVORY",
    "SKIN",
    "Camera",
    "ColorScale",
    "Lighting",
    "Lines",
    "Markers",
    "Material",
    "Renderer",
    "Row",
    "add_legend",
    "contact_sheet",
    "side_by_side",
    "write_video",
]
