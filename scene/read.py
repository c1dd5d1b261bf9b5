# SPDX-License-Identifier: GPL-3.0-or-later
"""Read a scene, as a render would see it, into ``core.snapshot.SceneSnapshot``."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np

from ..core.errors import InputError
from ..core.kept import Kept
from ..core.light_links import Links
from ..core.snapshot import DIFFUSE_RAYS, SHADOW_RAYS, Light, SceneSnapshot, World
from ..core.steps import STEP_SECONDS, Pace, Steps, run
from .camera import read_camera
from .evaluation import as_in_viewport, at_render_quality, rendered_objects
from .geometry import MeshArrays, MeshCopy, copy_mesh, triangulated
from .images import ImageTable
from .instance_facts import InstanceFacts, facts_of
from .light_linking import LightLinking
from .lights import INTENSITY_PROPERTY, LightTable
from .materials import Look, MaterialTable
from .notices import Notices
from .placed_mesh import PlacedMesh, joined_surface
from .shader_values import Domain
from .surface_parts import AtlasUVs, SurfaceParts
from .surface_values import ATLAS, Wants, wants
from .temporary import at_frame
from .volumes import find_volumes
from .world import read_world

# Converted curves, text, surfaces and metaballs arrive as separate mesh instances of the same object.
_WITHOUT_SURFACE = {
    "VOLUME": "volumes",
    "POINTCLOUD": "point clouds",
    "CURVES": "hair curves",
    "GREASEPENCIL": "grease pencil",
    "GPENCIL": "grease pencil",
}

_MOST_ALONE = 64  # instances of meshes whose materials tell them apart; the rest look like the last one


@dataclass
class _Coat:
    """What the triangles of a mesh show to some: where materials have a back of their own, there are several."""

    rows: np.ndarray  # per slot, of the table of materials; −1 none
    atlases: list[AtlasUVs]  # of those that have one


@dataclass
class _Instances:
    """All instances of one mesh with one set of materials."""

    mesh_key: tuple
    mesh: MeshArrays = field(init=False)  # as soon as the mesh's copy is triangulated
    materials: list[bpy.types.Material | None]  # per slot, original datablocks
    look: Look
    facts: InstanceFacts  # of the first one
    coats: list[_Coat] = field(default_factory=list)  # as soon as the materials are read
    matrices: list[np.ndarray] = field(default_factory=list)
    names: list[str] = field(default_factory=list)


@dataclass
class _Harvest:
    """What has to be taken out of the depsgraph while it lives."""

    groups: dict[tuple, _Instances] = field(default_factory=dict)
    meshes: dict[tuple, tuple[MeshCopy, str]] = field(default_factory=dict)  # and the name of the first with it
    wants: dict[int, Wants] = field(default_factory=dict)  # by material
    alone: int = 0  # instances so far of meshes whose materials tell them apart
    lights: list[tuple[bpy.types.Object, np.ndarray, str, int]] = field(default_factory=list)  # with their groups


def read_scene(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer | None = None,
    *,
    frame: int | None = None,
    live: bool = False,
) -> SceneSnapshot:
    """Everything that light needs to know about ``scene``, in world space.

    Args:
        view_layer: the first one by default.
        frame: evaluate there; the scene is back at its own frame afterwards.
        live: read what the viewport shows, at its subdivision levels, instead of what a render would. Nothing is
            evaluated anew, so this is the way to follow edits.

    Raises:
        RuntimeError: Blender is rendering and cannot evaluate the scene at render quality now.
    """
    view_layer = view_layer or scene.view_layers[0]
    with at_frame(scene, frame):
        return run(_read(scene, view_layer, as_in_viewport if live else at_render_quality, Pace(None)))


def read_in_steps(
    scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer | None = None, *, live: bool = False
) -> Steps[SceneSnapshot]:
    """``read_scene`` in steps: in one of them Blender evaluates the scene and its arrays are copied, in the second, or
    with ``live`` in the first, so that two readings side by side take turns at it. Materials follow, one by one, and
    triangles in a thread.

    Raises:
        InputError: something of it was deleted between two steps.
        RuntimeError: as ``read_scene``.
    """
    try:
        view_layer = view_layer or scene.view_layers[0]
        steps = _read(scene, view_layer, as_in_viewport if live else at_render_quality, Pace(STEP_SECONDS))
        if not live:
            yield
        next(steps)
        yield
        if live:
            yield
        return (yield from steps)
    except ReferenceError as error:  # how Blender tells that a datablock is gone
        raise InputError("something was deleted while the scene was read; bake again") from error


def read_evaluated(depsgraph: bpy.types.Depsgraph, world: World) -> SceneSnapshot:
    """The scene as ``depsgraph`` has it: for render engines, inside whose callbacks nothing else can be evaluated.

    ``world`` is the background, which may take a render to find out.
    """

    def evaluate(_scene, _view_layer, visit):
        return visit(depsgraph)

    return run(_read(depsgraph.scene, depsgraph.view_layer, evaluate, Pace(None), world))


def read_lights(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> list[Light]:
    """The lights of ``read_scene(live=True)`` alone, in a fraction of the time."""
    notices = Notices()
    rigid_bodies = scene.rigidbody_world is not None
    harvest = as_in_viewport(
        scene,
        view_layer,
        lambda depsgraph: _harvest(depsgraph, rendered_objects(view_layer), rigid_bodies, notices, meshes=False),
    )
    lights = LightTable(ImageTable(notices), notices, measures=False)
    for found in harvest.lights:
        lights.add(*found)
    return lights.lights


def _read(scene, view_layer, evaluate, pace: Pace, world: World | None = None) -> Steps[SceneSnapshot]:
    notices = Notices()
    harvest = evaluate(
        scene,
        view_layer,
        lambda depsgraph: _harvest(depsgraph, rendered_objects(view_layer), scene.rigidbody_world is not None, notices),
    )
    about = {
        "volumes": find_volumes(scene),
        "camera": read_camera(scene),
        "exposure": float(scene.view_settings.exposure),
        "frame": scene.frame_current,
        "name": scene.name,
    }
    yield
    meshes = yield from pace.in_background(_all_triangulated, harvest.meshes, notices)
    images = ImageTable(notices)
    surfaces = SurfaceParts()
    # Inside a render engine's callback Cycles cannot be asked, and so no atlas be filled.
    materials = MaterialTable(images, notices, surfaces if world is None else None)
    override = view_layer.material_override
    for group in harvest.groups.values():
        group.mesh = meshes[group.mesh_key]
        group.materials = [override] if override else group.materials or [None]
        surfaces.add(group, group.materials)
    for group in harvest.groups.values():
        shown = []
        for material in group.materials:
            shown.append(materials.coats(materials.index(material, group.look)))
            yield
        group.coats = _coats(group, shown, materials, surfaces)
    surface = yield from pace.in_background(_surface, list(harvest.groups.values()), materials, notices)
    lights = LightTable(images, notices, measures=world is None)
    for found in harvest.lights:
        lights.add(*found)
    yield
    background = world or read_world(scene, notices)
    yield
    return SceneSnapshot(
        **surface,
        **about,
        object_names=[name for group in harvest.groups.values() for name in group.names],
        materials=materials.materials,
        images=images.images,
        lights=lights.lights,
        world=background,
        warnings=notices.lines(),
    )


def _harvest(
    depsgraph: bpy.types.Depsgraph, rendered: set[int], rigid_bodies: bool, notices: Notices, meshes: bool = True
) -> _Harvest:
    """Take meshes, lights and their places out of ``depsgraph``.

    Args:
        rendered: ``session_uid`` of the objects that a render shows; a viewport depsgraph holds others too.
        rigid_bodies: a simulation moves objects. Its state stays with the user's scene when that is copied for reading,
            so their places are taken from there.
    """
    harvest = _Harvest()
    linking = LightLinking(depsgraph.objects)
    for instance in depsgraph.object_instances:  # each one dies with its step of the iterator
        item = instance.object
        owner = instance.parent if instance.is_instance else item
        if not instance.show_self or item.hide_render or owner.original.session_uid not in rendered:
            continue
        if item.type in _WITHOUT_SURFACE:
            notices.group(f"{_WITHOUT_SURFACE[item.type]} are not supported and are left out", item.name)
        if item.type not in ("MESH", "LIGHT") or not (meshes or item.type == "LIGHT"):
            continue
        simulated = rigid_bodies and not instance.is_instance and not item.hide_viewport
        matrix = np.array(item.original.matrix_world if simulated else instance.matrix_world, dtype=np.float64)
        name = f"{instance.parent.name} > {item.name}" if instance.is_instance else item.name
        if not np.isfinite(matrix).all():
            notices.group("objects whose transform is not finite are left out", name)
        elif item.type == "LIGHT":
            harvest.lights.append((item.original, matrix, name, linking.group(item)))
        elif item.visible_diffuse or item.visible_shadow:
            _warn_of(item, notices)
            links = linking.links(item, instance.parent if instance.is_instance else None)
            _add_mesh(harvest, item, instance, matrix, name, _look(item, links))
    return harvest


def _warn_of(item: bpy.types.Object, notices: Notices) -> None:
    """What of the object is left out."""
    for system in item.particle_systems:
        if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
            notices.group("particle hair is not supported and is left out", item.name)
    if item.is_shadow_catcher or item.is_holdout:
        notices.group("holdouts and shadow catchers are lit like any other surface", item.name)


def _look(item: bpy.types.Object, links: Links) -> Look:
    unseen = (0 if item.visible_shadow else SHADOW_RAYS) + (0 if item.visible_diffuse else DIFFUSE_RAYS)
    return Look(float(item.get(INTENSITY_PROPERTY, 1.0)), unseen, links)


def _add_mesh(harvest: _Harvest, item, instance, matrix: np.ndarray, name: str, look: Look) -> None:
    mesh = item.data
    slots = _slot_materials(item, mesh)
    asked = [_wants(harvest, material) for material in slots]
    attributes = frozenset().union(*(one.attributes for one in asked))
    key = (mesh.as_pointer(), attributes)
    if key not in harvest.meshes:
        harvest.meshes[key] = _copy_of(item, sorted(attributes)), name
    alone = -1
    if any(one.instance for one in asked):
        alone = harvest.alone = min(harvest.alone + 1, _MOST_ALONE)
    group_key = (key, look, alone, *(material.as_pointer() if material else 0 for material in slots))
    group = harvest.groups.get(group_key)
    if group is None:
        facts = facts_of(item, instance, frozenset().union(*(one.properties for one in asked)))
        group = harvest.groups[group_key] = _Instances(key, slots, look, facts)
    group.matrices.append(matrix)
    group.names.append(name)


def _copy_of(item: bpy.types.Object, attributes: list[str]) -> MeshCopy:
    """Of the mesh of an evaluated object. What is being edited lies outside the datablock, modifiers included."""
    if not item.data.is_editmode:
        return copy_mesh(item.data, attributes)
    try:
        return copy_mesh(item.to_mesh(), attributes)
    finally:
        item.to_mesh_clear()


def _wants(harvest: _Harvest, material: bpy.types.Material | None) -> Wants:
    key = material.as_pointer() if material is not None else 0
    if key not in harvest.wants:
        harvest.wants[key] = wants(material)
    return harvest.wants[key]


def _slot_materials(item: bpy.types.Object, mesh: bpy.types.Mesh) -> list[bpy.types.Material | None]:
    """Material of every slot: the object's where it is linked to the object, else the evaluated mesh's."""
    materials = list(mesh.materials)
    for index, slot in enumerate(item.material_slots):
        if slot.link == "OBJECT":
            materials += [None] * (index + 1 - len(materials))
            materials[index] = slot.material
    return [material.original if material else None for material in materials]


_kept_triangles = Kept(lambda copies: [triangulated(copy) for copy in copies])
_kept_surface = Kept(joined_surface)


def _all_triangulated(meshes: dict[tuple, tuple[MeshCopy, str]], notices: Notices) -> dict[tuple, MeshArrays]:
    found = _kept_triangles([copy for copy, _name in meshes.values()])
    for arrays, (_copy, name) in zip(found, meshes.values()):
        if arrays.not_finite:
            notices.append(
                f"object '{name}': {arrays.not_finite} triangles have corners that are not finite and are left out; "
                "clean the mesh up"
            )
        if arrays.needles:
            notices.group("triangles without area are left out", f"{name} ({arrays.needles})")
    return dict(zip(meshes, found))


def _coats(group: _Instances, shown: list[list[int]], materials: MaterialTable, surfaces: SurfaceParts) -> list[_Coat]:
    """``shown``: per slot the rows of its material."""
    coats = []
    for number in range(max(map(len, shown))):
        rows = np.array([own[number] if number < len(own) else -1 for own in shown], np.int32)
        placed = {
            material for row, material in zip(rows, group.materials) if row >= 0 and materials.domains[row] == ATLAS
        }
        atlases = [atlas for material in placed if (atlas := surfaces.corner_uvs(material, group)) is not None]
        coats.append(_Coat(rows, atlases))
    return coats


def _surface(groups: list[_Instances], materials: MaterialTable, notices: Notices) -> dict[str, np.ndarray]:
    """All triangles of the scene with their per-triangle arrays. Asks Blender nothing: all materials are read."""
    first = np.cumsum([0, *(len(group.matrices) for group in groups)])
    placed, sources = [], []
    for number in range(max((len(group.coats) for group in groups), default=0)):  # most scenes have one
        for group, first_object in zip(groups, first.tolist()):
            if number < len(group.coats):
                placed.append(_placed(group, group.coats[number], first_object, materials))
                sources.append((group, group.coats[number]))
    arrays, without_uvs = _kept_surface(placed)
    for index, slot in without_uvs:
        group, coat = sources[index]
        name = materials.materials[coat.rows[slot]].name
        notices.group(f"without the UV map of material '{name}' a texture shows one colour", group.names[0])
    return arrays


def _placed(group: _Instances, coat: _Coat, first_object: int, materials: MaterialTable) -> PlacedMesh:
    def domain(row: int) -> Domain | None:
        return materials.domains[row] if row >= 0 and materials.is_textured(row) else None

    return PlacedMesh(
        group.mesh,
        coat.rows,
        [domain(row) for row in coat.rows],
        np.array([row < 0 or materials.is_hole(row) for row in coat.rows], bool),
        coat.atlases,
        np.array(group.matrices),
        first_object,
    )
