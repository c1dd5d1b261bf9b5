# SPDX-License-Identifier: GPL-3.0-or-later
"""The world as background radiance: one colour, an environment image, or whatever Cycles shows of it.

Plain colours and equirectangular images (in any rotation) are read directly. Every other tree, such as a sky texture, a
gradient or a mirror ball, is rendered once with nothing else in sight.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..core.panorama import panorama_coordinates, panorama_directions
from ..core.snapshot import World
from .cycles_reference import panoramic_camera, unbiased_settings
from .images import ImageTable
from .node_links import Unsupported, active_output, find_socket, resolve
from .notices import Notices
from .ray_nodes import DIFFUSE_RAY
from .shader_nodes import NodeEvaluator
from .temporary import leave_nothing_behind, new_camera, plain_render_settings, render_pixels
from .texture_coordinates import affine_coordinates

RENDERED_WIDTH, RENDERED_HEIGHT, RENDERED_SAMPLES = 256, 128, 64

# A sun disc covers a fraction of a pixel and outshines everything: pixels this much brighter than the mean are rendered
# again, with enough samples that the disc's share of them is right.
_SUN_CONTRAST, _SUN_SAMPLES, _SUN_MAX_PIXELS = 20.0, 8192, 256


def read_world(scene: bpy.types.Scene, notices: Notices) -> World:
    """Background radiance of ``scene`` as diffuse surfaces receive it."""
    world = scene.world
    if world is None or not world.cycles_visibility.diffuse:
        return World()
    if world.node_tree is None or not world.use_nodes:
        return World(color=_rgb(world.color))
    output = active_output(world.node_tree, "ShaderNodeOutputWorld")
    if output is None:
        return World()
    if find_socket(output.inputs, "Volume").is_linked:
        notices.append(f"world '{world.name}': its volume is not supported and is left out")
    surface = find_socket(output.inputs, "Surface")
    if not surface.is_linked:
        return World()
    return _read_directly(world, surface) or World(map=_rendered(scene, world))


def needs_render(scene: bpy.types.Scene) -> bool:
    """Whether ``read_world`` has to render to find out, which cannot be done while Blender renders."""
    world = scene.world
    if world is None or world.node_tree is None or not world.use_nodes or not world.cycles_visibility.diffuse:
        return False
    output = active_output(world.node_tree, "ShaderNodeOutputWorld")
    surface = find_socket(output.inputs, "Surface") if output else None
    return surface is not None and surface.is_linked and _read_directly(world, surface) is None


def _read_directly(world: bpy.types.World, surface: bpy.types.NodeSocket) -> World | None:
    """The world of a Background node with a colour or an environment image; None where only a render can tell."""
    ignored = Notices()  # what cannot be evaluated here is rendered, so there is nothing to warn of
    evaluator = NodeEvaluator(f"world '{world.name}'", ImageTable(ignored), ignored, world.name)
    try:
        source, scope = resolve(surface, None)
        if source.node.bl_idname != "ShaderNodeBackground":
            return None
        strength = evaluator.input(source.node, "Strength", scope)
        color_source, color_scope = resolve(find_socket(source.node.inputs, "Color"), scope)
        if ignored.lines() or not strength.is_constant:
            return None
        if color_source.is_output and color_source.node.bl_idname == "ShaderNodeTexEnvironment":
            panorama = _environment(evaluator, color_source.node, color_scope)
            return World(map=panorama * np.float32(strength.number()))
        color = evaluator.input(source.node, "Color", scope)
    except Unsupported:
        return None
    if ignored.lines() or not color.is_constant:
        return None
    return World(color=_rgb(color.rgb() * strength.number()))


def _environment(evaluator: NodeEvaluator, node: bpy.types.Node, scope) -> np.ndarray:
    """(height, width, 3) radiance of an equirectangular image, turned as its Mapping says.

    Raises:
        Unsupported: another projection, a missing image, or a mapping that is more than a rotation.
    """
    if node.projection != "EQUIRECTANGULAR" or node.image is None:
        raise Unsupported("not an equirectangular image")
    pixels = evaluator.images.pixels(node.image, evaluator.owner)
    if pixels is None:
        raise Unsupported("its image is missing")
    _, matrix = affine_coordinates(evaluator, find_socket(node.inputs, "Vector"), scope, _is_direction)
    rotation = matrix[:3, :3]
    if matrix[:3, 3].any() or not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6):
        raise Unsupported("its mapping is more than a rotation")
    radiance = pixels[..., :3] * pixels[..., 3:]
    if np.allclose(rotation, np.eye(3), atol=1e-9):
        return np.ascontiguousarray(radiance)
    height, width = radiance.shape[:2]
    return _sample(radiance, panorama_directions(width, height) @ rotation.T)


def _is_direction(source) -> str | None:
    """Generated coordinates of a world are directions; environment textures take them by default."""
    return (
        "" if source is None or (source.node.bl_idname == "ShaderNodeTexCoord" and source.name == "Generated") else None
    )


def _sample(panorama: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Bilinear radiance of ``panorama`` (height, width, 3) along ``directions`` (…, 3), float32."""
    height, width = panorama.shape[:2]
    position = panorama_coordinates(directions) * [width, height] - 0.5
    low = np.floor(position).astype(int)
    (share_x, share_y) = np.moveaxis((position - low)[..., None].astype(np.float32), -2, 0)
    columns = [low[..., 0] % width, (low[..., 0] + 1) % width]
    rows = [np.clip(low[..., 1], 0, height - 1), np.clip(low[..., 1] + 1, 0, height - 1)]
    below = panorama[rows[0], columns[0]] * (1 - share_x) + panorama[rows[0], columns[1]] * share_x
    above = panorama[rows[1], columns[0]] * (1 - share_x) + panorama[rows[1], columns[1]] * share_x
    return below * (1 - share_y) + above * share_y


def _rendered(scene: bpy.types.Scene, world: bpy.types.World) -> np.ndarray:
    """(RENDERED_HEIGHT, RENDERED_WIDTH, 3) radiance of ``world`` as diffuse rays see it, rendered alone with Cycles."""
    with leave_nothing_behind():
        alone = bpy.data.scenes.new("Gridlight World")
        alone.frame_set(scene.frame_current)
        alone.world = _seen_by_diffuse_rays(world)
        alone.camera = new_camera(alone)
        panoramic_camera(alone.camera)
        plain_render_settings(alone)
        unbiased_settings(alone, RENDERED_SAMPLES, bounces=0)
        alone.render.resolution_x, alone.render.resolution_y = RENDERED_WIDTH, RENDERED_HEIGHT
        layer = alone.view_layers[0].name
        panorama = render_pixels(alone, layer)
        _refine_sun(alone, layer, panorama)
        return panorama


def _refine_sun(scene: bpy.types.Scene, layer: str, panorama: np.ndarray) -> None:
    """Replace the few pixels of ``panorama`` around a sun by well sampled ones."""
    brightness = panorama.mean(axis=-1)
    rows, columns = np.nonzero(brightness > _SUN_CONTRAST * brightness.mean())
    if not len(rows):
        return
    height, width = brightness.shape
    # One pixel more on every side, where samples may have missed the disc's rim.
    bottom, top = max(rows.min() - 1, 0), min(rows.max() + 2, height)
    left, right = max(columns.min() - 1, 0), min(columns.max() + 2, width)
    if (top - bottom) * (right - left) > _SUN_MAX_PIXELS:
        return  # several bright places or a broad one: neither is missed by samples
    render = scene.render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x = left / width, right / width
    render.border_min_y, render.border_max_y = bottom / height, top / height
    scene.cycles.samples = _SUN_SAMPLES
    panorama[bottom:top, left:right] = render_pixels(scene, layer)


def _seen_by_diffuse_rays(world: bpy.types.World) -> bpy.types.World:
    """A copy of ``world`` whose camera rays are answered like diffuse ones."""
    copy = world.copy()
    copy.cycles_visibility.camera = True
    tree = copy.node_tree
    for link in [link for link in tree.links if link.from_node.bl_idname == "ShaderNodeLightPath"]:
        if link.to_socket.type == "VALUE":
            link.to_socket.default_value = DIFFUSE_RAY.get(link.from_socket.name, 0.0)
            tree.links.remove(link)
    return copy


def _rgb(color) -> tuple[float, float, float]:
    red, green, blue = (float(channel) for channel in color)
    return red, green, blue
