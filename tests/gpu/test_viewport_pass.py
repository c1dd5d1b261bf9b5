# SPDX-License-Identifier: GPL-3.0-or-later
"""What the viewport draws, without a window: against core/lookup.py, closed forms, and the traced pictures."""

import gpu
import numpy as np
import pytest
from gridlight.core import lookup
from gridlight.core.camera import Camera, look
from gridlight.core.conventions import ACTIVE, CULLED, DEPTH_EDGE, INVALID
from gridlight.core.cubemap import direction_to_texel, octahedral_encode, pack_normal
from gridlight.core.depth_map import map_directions
from gridlight.core.display import standard_view, uneven
from gridlight.core.emitters import sampling_density
from gridlight.core.field import Field
from gridlight.core.grid import Grid
from gridlight.core.snapshot import Light, Material, World
from gridlight.core.view import View
from gridlight.core.world_map import world_texels
from gridlight.gpu_shaders.preview_pass import PreviewPass
from gridlight.gpu_shaders.scene_textures import SceneTextures
from gridlight.gpu_shaders.textures import read
from gridlight.gpu_shaders.viewport_field import FieldTextures
from gridlight.gpu_shaders.viewport_pass import Picture, Probes, ViewportPass, display
from gridlight.gpu_shaders.viewport_shading import BACKGROUND_FACE, Shading
from small_scenes import box, cluttered_room, frame, snapshot_of

WIDTH, HEIGHT = 96, 54
ASPECT = WIDTH / HEIGHT


def textures_of(snapshot, origin):
    return SceneTextures(snapshot, origin, np.zeros(len(snapshot.triangles)))


def drawn(snapshot, fields, view, shading, *, samples=1, probes=None, visible=None, size=(WIDTH, HEIGHT)):
    """(height, width, 4) mean of samples, and the Picture."""
    origin = fields[0].grid.center if fields else np.zeros(3)
    drawing = ViewportPass(textures_of(snapshot, origin), origin, len(snapshot.object_names), snapshot.world)
    drawing.set_fields([FieldTextures(field, origin) for field in fields])
    flags = drawing.visible(visible)
    picture = Picture(*size)
    for _ in range(samples):
        drawing.draw(picture, view, shading, probes, flags)
    return picture.read(), picture


def pixel_rays(camera, width=WIDTH, height=HEIGHT):
    """Origins and unit directions (height, width, 3) through pixel centres."""
    x = (np.arange(width) + 0.5) / width * 2 - 1
    y = (np.arange(height) + 0.5) / height * 2 - 1
    across = x[None, :, None] * camera.right + y[:, None, None] * camera.up
    if camera.orthographic:
        return camera.position + across, np.broadcast_to(camera.forward, across.shape)
    direction = camera.forward + across
    return np.broadcast_to(camera.position, across.shape), direction / np.linalg.norm(direction, axis=2, keepdims=True)


def floor_hits(camera, height=0.0):
    """Where the rays of ``camera`` meet the plane z = height: (HEIGHT, WIDTH, 3)."""
    origin, direction = pixel_rays(camera)
    return origin + direction * ((height - origin[..., 2:]) / direction[..., 2:])


def floor(size=50.0, albedo=(0.8, 0.5, 0.3), centre=(0, 0, 0), **options):
    a, b, c, d = (np.array([x * size, y * size, 0]) + centre for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    return snapshot_of([[a, b, c], [a, c, d]], materials=[Material("floor", albedo)], **options)


def random_field(seed=0, centre=(0.0, 0.0, 0.0), bands=3):
    """A turned grid with probes of every state, moved a little, and depth that hides some from some places."""
    generator = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(generator.normal(size=(3, 3)))
    matrix = np.eye(4)
    matrix[:3, :3] = turn * [3.0, 2.0, 1.5]
    matrix[:3, 3] = centre
    field = Field.empty(Grid(matrix, (5, 4, 3)), bands)
    count = field.grid.count
    field.coefficients[:] = generator.normal(0, 0.2, field.coefficients.shape)
    field.coefficients[:, 0] = generator.uniform(1.0, 3.0, (count, 3))
    field.gradient[:] = generator.normal(0, 0.1, field.gradient.shape)
    field.state[:] = generator.choice([ACTIVE, ACTIVE, ACTIVE, CULLED, INVALID], count)
    field.offset[:] = generator.uniform(-0.1, 0.1, (count, 3))
    mean = generator.uniform(0.2, 3.0, (count, DEPTH_EDGE**2))
    field.depth[..., 0], field.depth[..., 1] = mean, mean**2 * generator.uniform(1.0, 1.2, mean.shape)
    normals = generator.normal(size=(*mean.shape, 3)) - 2.0 * map_directions()  # most of them towards the probe
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    packed = pack_normal(octahedral_encode(normals))
    field.depth[..., 2] = np.where(generator.random(count) < 0.2, 0.0, packed.T).T  # of some probes not known
    field.depth[..., 3] = mean * generator.uniform(0.9, 1.1, mean.shape)
    return field


@pytest.mark.parametrize("bands, centre", [(3, (0.0, 0.0, 0.0)), (4, (1e5, -3e4, 200.0))], ids=["here", "100 km away"])
def test_pixels_read_the_field_as_the_reference_does(bands, centre):
    field = random_field(3, centre, bands)
    centre = np.array(centre)
    camera = look(centre + [-2.5, -2.0, 1.2], centre + [0.3, 0.2, 0.0], ASPECT, 0.8)
    pixels, _ = drawn(floor(centre=centre), [field], View.from_camera(camera, 0.1, 200), Shading("IRRADIANCE"))
    hit = pixels[..., 3] > 0
    assert 0.4 < hit.mean() < 1.0  # the horizon is in the picture, and data views have no background
    points = floor_hits(camera, centre[2])[hit]
    near = np.linalg.norm(points - centre, axis=1) < 40.0  # farther out a pixel's centre is not known so well
    expected = lookup.irradiance(field, points, np.tile([0.0, 0.0, 1.0], (len(points), 1))) / np.pi
    error = np.abs(pixels[hit][near, :3] - np.maximum(expected[near], 0))
    # single pixels whose probes are about to be hidden decide by the last digits
    assert (error <= 2e-3 + 2e-3 * expected[near]).mean() > 0.999 and error.max() < 0.02
    assert np.median(error) < 2e-5


def test_parallel_view_reads_the_same_field():
    field = random_field(5)
    camera = Camera(
        np.array([0.2, 0.1, 5.0]), np.array([2.0, 0, 0]), np.array([0, 1.2, 0]), np.array([0, 0, -1.0]), True
    )
    pixels, _ = drawn(floor(), [field], View.from_camera(camera, 0.1, 20), Shading("IRRADIANCE"))
    points = floor_hits(camera).reshape(-1, 3)
    expected = np.maximum(lookup.irradiance(field, points, np.tile([0.0, 0.0, 1.0], (len(points), 1))) / np.pi, 0)
    found = pixels[..., :3].reshape(-1, 3)
    np.testing.assert_allclose(found, expected, rtol=1e-2, atol=1e-3)
    # single pixels whose probes are about to be hidden decide by the last digits
    assert (np.abs(found - expected) <= 1e-4 + 1e-3 * expected).mean() > 0.999


def test_direct_light_and_highlight_of_a_point_light():
    """I·cosθ/d² through albedo/π, plus the Phong lobe k·(n + 2)/2π·cosⁿ of the mirrored ray."""
    place, intensity = np.array([0.4, 0.6, 1.5]), np.array([3.0, 2.0, 1.0])
    snapshot = floor(lights=[Light("lamp", "POINT", tuple(intensity), frame(place))])
    camera = look((-1.5, -1.8, 1.4), (0.1, 0.2, 0), ASPECT, 0.5)
    view = View.from_camera(camera, 0.1, 100)
    for highlight in (0.0, 0.5):
        pixels, _ = drawn(snapshot, [], view, Shading("DIRECT", highlight=highlight))
        points = floor_hits(camera)
        to_light = place - points
        distance = np.linalg.norm(to_light, axis=2, keepdims=True)
        to_light /= distance
        irradiance = intensity * to_light[..., 2:] / distance**2
        _, direction = pixel_rays(camera)
        mirrored = direction * [1, 1, -1]
        lobe = highlight * 42.0 / (2 * np.pi) * np.maximum((mirrored * to_light).sum(2, keepdims=True), 0) ** 40
        expected = (np.array([0.8, 0.5, 0.3]) / np.pi + lobe) * irradiance
        seen = pixels[..., 3] > 0
        np.testing.assert_allclose(pixels[seen][:, :3], expected[seen], rtol=2e-3, atol=1e-5)


def test_modes_are_parts_of_the_whole():
    field = random_field(7)
    snapshot = floor(lights=[Light("lamp", "POINT", (3, 2, 1), frame((0.4, 0.6, 1.5)))])
    view = View.from_camera(look((-1.5, -1.8, 1.4), (0, 0, 0), ASPECT, 0.5), 0.1, 100)
    full, direct, indirect, irradiance, doubled = (
        drawn(snapshot, [field], view, shading)[0][..., :3]
        for shading in (
            Shading("FULL"),
            Shading("DIRECT"),
            Shading("INDIRECT"),
            Shading("IRRADIANCE"),
            Shading("FULL", indirect=2.0),
        )
    )
    np.testing.assert_allclose(full, direct + indirect, rtol=1e-5)
    np.testing.assert_allclose(indirect, irradiance * np.float32([0.8, 0.5, 0.3]), rtol=1e-5)
    np.testing.assert_allclose(doubled, direct + 2 * indirect, rtol=1e-5)


def test_normals_look_as_their_numbers():
    pixels, _ = drawn(
        floor(), [], View.from_camera(look((0, 0, 3), (0.01, 0, 0), ASPECT), 0.1, 100), Shading("NORMALS")
    )
    np.testing.assert_allclose(standard_view(pixels, 0.0)[..., :3] - [0.5, 0.5, 1.0], 0.0, atol=1e-6)


def uniform_field(grid, radiance, bands=2):
    field = Field.empty(grid, bands)
    field.coefficients[:, 0] = radiance * np.sqrt(4 * np.pi)
    field.depth[..., :2] = 100.0, 10000.0
    return field


def test_each_point_is_lit_by_its_own_volume():
    """The smallest box that holds a point, outside all the nearest."""
    fields = [
        uniform_field(Grid.from_bounds((-4, -4, -1), (4, 4, 1), (3, 3, 2)), 1.0),
        uniform_field(Grid.from_bounds((0, 0, -0.5), (1, 1, 0.5), (2, 2, 2)), 2.0),
        uniform_field(Grid.from_bounds((6, -4, -1), (8, 4, 1), (2, 2, 2)), 3.0),
    ]
    camera = Camera(np.array([2.0, 0, 9.0]), np.array([9.0, 0, 0]), np.array([0, 5.0, 0]), np.array([0, 0, -1.0]), True)
    pixels, _ = drawn(floor(albedo=(1, 1, 1)), fields, View.from_camera(camera, 0.1, 20), Shading("IRRADIANCE"))
    x, y, _ = np.moveaxis(floor_hits(camera), 2, 0)
    expected = np.where(x > 5.0, 3.0, 1.0)
    expected[(x > 0) & (x < 1) & (y > 0) & (y < 1)] = 2.0
    np.testing.assert_allclose(pixels[..., 0], expected, rtol=1e-5)
    assert set(np.unique(expected)) == {1.0, 2.0, 3.0}


def test_hidden_objects_are_not_drawn_but_cast_shadows():
    quad = box((-0.5, -0.5, 1.0), (0.5, 0.5, 1.2))
    ground = floor(5.0).triangle_positions
    snapshot = snapshot_of(
        np.concatenate([ground, quad]),
        materials=[Material("white", (1.0, 1.0, 1.0))],
        objects=[0, 0] + [1] * len(quad),
        lights=[Light("sun", "SUN", (np.pi,) * 3, frame(towards=(0, 0, -1)))],
    )
    camera = Camera(np.array([0.0, 0, 9.0]), np.array([2.0, 0, 0]), np.array([0, 1.1, 0]), np.array([0, 0, -1.0]), True)
    view = View.from_camera(camera, 0.1, 20)
    shown, picture = drawn(snapshot, [], view, Shading("DIRECT", highlight=0))
    hidden, other = drawn(snapshot, [], view, Shading("DIRECT", highlight=0), visible=np.array([True, False]))
    x, y, _ = np.moveaxis(floor_hits(camera), 2, 0)
    beneath = (np.abs(x) < 0.48) & (np.abs(y) < 0.48)
    np.testing.assert_allclose(shown[..., 0], 1.0, rtol=1e-5)  # the top of the box is as bright as the ground
    np.testing.assert_allclose(hidden[beneath][:, 0], 0.0, atol=1e-6)
    depth = [depth_of(item) for item in (picture, other)]
    np.testing.assert_allclose(depth[0][beneath], (9.0 - 1.2 - 0.1) / 19.9, rtol=1e-5)
    np.testing.assert_allclose(depth[1][beneath], (9.0 - 0.1) / 19.9, rtol=1e-5)


def depth_of(picture):
    """(height, width) depth of ``picture``, by way of ``display``."""
    target = gpu.types.GPUTexture((picture.width, picture.height), format="RGBA32F")
    depth = gpu.types.GPUTexture((picture.width, picture.height), format="DEPTH_COMPONENT32F")
    shown_on(target, depth, picture, "SCENE_LINEAR")
    framebuffer = gpu.types.GPUFrameBuffer(color_slots=(target,), depth_slot=depth)
    with framebuffer.bind():
        buffer = framebuffer.read_depth(0, 0, picture.width, picture.height)
    buffer.dimensions = picture.width * picture.height
    return np.frombuffer(buffer, np.float32).reshape(picture.height, picture.width).copy()


def shown_on(target, depth, picture, encoding, **options):
    target.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
    depth.clear(format="FLOAT", value=(1.0,))
    with gpu.types.GPUFrameBuffer(color_slots=(target,), depth_slot=depth).bind():
        gpu.state.viewport_set(0, 0, picture.width, picture.height)
        gpu.state.depth_test_set("ALWAYS")
        gpu.state.depth_mask_set(True)
        gpu.state.blend_set("NONE")
        display(picture, encoding, **options)
        gpu.state.depth_test_set("NONE")
        gpu.state.depth_mask_set(False)


def test_coarse_pictures_cover_the_surfaces_that_they_show():
    """Blender has drawn the floor pixel by pixel; a picture of a fifth of its pixels must not lose half of them."""
    view = View.from_camera(look((0, 0, 0.5), (10, 3, 0), ASPECT, 0.7), 0.1, 100)
    _, fine = drawn(floor(), [], view, Shading("NORMALS"), size=(5 * WIDTH, 5 * HEIGHT))
    _, coarse = drawn(floor(), [], view, Shading("NORMALS"))
    size = fine.width, fine.height
    target = gpu.types.GPUTexture(size, format="RGBA32F")
    depth = gpu.types.GPUTexture(size, format="DEPTH_COMPONENT32F")
    shown_on(target, depth, fine, "SCENE_LINEAR")
    target.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
    with gpu.types.GPUFrameBuffer(color_slots=(target,), depth_slot=depth).bind():
        gpu.state.depth_test_set("LESS_EQUAL")
        display(coarse, "SCENE_LINEAR")
        gpu.state.depth_test_set("NONE")
    covered = read(target, size[0] * size[1]).reshape(size[1], size[0], 4)[..., 3]
    ground = fine.read()[..., 3] == 1
    assert 0.3 < ground.mean() < 0.9
    inside = ground[5:-5, 5:-5] & ground[10:, 5:-5]  # not where the coarse picture sees the sky
    assert covered[5:-5, 5:-5][inside].mean() == 1.0, covered[5:-5, 5:-5][inside].mean()


def test_display_is_blenders_standard_view():
    field = random_field(2)
    snapshot = floor(lights=[Light("lamp", "POINT", (30, 20, 10), frame((0.4, 0.6, 1.5)))])
    view = View.from_camera(look((-1.5, -1.8, 1.4), (0, 0, 0), ASPECT, 0.5), 0.1, 100)
    pixels, picture = drawn(snapshot, [field], view, Shading())
    assert pixels.max() > 1.5 and pixels[..., :3].min() < 0.5
    target = gpu.types.GPUTexture((WIDTH, HEIGHT), format="RGBA32F")
    depth = gpu.types.GPUTexture((WIDTH, HEIGHT), format="DEPTH_COMPONENT32F")

    def shown(encoding, **options):
        shown_on(target, depth, picture, encoding, **options)
        return read(target, WIDTH * HEIGHT).reshape(HEIGHT, WIDTH, 4)[..., :3]

    standard = standard_view(pixels[..., :3], -1.0)
    np.testing.assert_allclose(shown("SCENE_LINEAR"), pixels[..., :3], rtol=1e-6)
    np.testing.assert_allclose(shown("DISPLAY", exposure=-1.0), standard, atol=1e-5)
    np.testing.assert_allclose(shown("OVERLAY", exposure=-1.0), standard**2.2, atol=1e-5)
    np.testing.assert_allclose(shown("DISPLAY", exposure=-1.0, gamma=1.4), standard ** (1 / 1.4), atol=1e-5)
    linear = np.clip(pixels[..., :3], 0, 1)
    np.testing.assert_allclose(shown("DISPLAY", tone_curve="LINEAR"), linear, atol=1e-6)
    filmic = shown("DISPLAY", tone_curve="FILMIC")
    order = np.argsort(pixels[..., 0].ravel())
    assert (np.diff(filmic[..., 0].ravel()[order]) >= -1e-6).all() and filmic.max() < 1.0
    assert (filmic[linear == 1.0] > 0.6).all()  # highlights are kept apart where Standard clips them


def test_probes_are_round_lit_by_themselves_and_marked_by_state():
    grid = Grid.from_bounds((-2, 0, 0.5), (2, 0.5, 1.0), (4, 1, 1))
    field = uniform_field(grid, 0.7, bands=3)
    field.coefficients[0, 2] = 0.3  # brighter from above
    field.state[:] = ACTIVE, CULLED, INVALID, ACTIVE
    middle = grid.positions()
    camera = Camera(
        middle.mean(0) + [0, -8.0, 0], np.array([2.4, 0, 0]), np.array([0, 0, 1.2]), np.array([0, 1.0, 0]), True
    )
    size = (480, 240)
    probes = Probes(0.6)
    radius = probes.radius(grid)
    for kind in ("IRRADIANCE", "RADIANCE"):
        pixels, _ = drawn(
            floor(0.1, centre=(0, 50, 0)),
            [field],
            View.from_camera(camera, 0.1, 40),
            Shading("IRRADIANCE", probes=kind),
            probes=probes,
            size=size,
        )
        origin, _ = pixel_rays(camera, *size)
        for node, share in enumerate((1.0, 0.5, 0.5, 1.0)):
            offset = origin - middle[node]
            across = np.hypot(offset[..., 0], offset[..., 2]) / (radius * share)
            inside = across < 0.98
            assert (pixels[inside, 3] == 1).all() and (pixels[(across > 1.02) & (across < 1.2), 3] == 0).all()
            if node == 1:
                np.testing.assert_allclose(pixels[inside, :3], 0.05, rtol=1e-5)
            elif node == 2:
                np.testing.assert_allclose(pixels[inside, :3], np.tile([0.4, 0.02, 0.02], (inside.sum(), 1)), rtol=1e-5)
            else:
                up = offset[inside, 2] / (radius * share)
                lobe = 2 / 3 if kind == "IRRADIANCE" else 1.0
                expected = 0.7 + (0.3 * lobe * 0.4886025119029199 * up if node == 0 else 0.0)
                np.testing.assert_allclose(pixels[inside, 0], expected, atol=2e-5)


def test_background_is_the_world_in_its_direction():
    generator = np.random.default_rng(4)
    world = World(map=generator.random((32, 64, 3)).astype(np.float32))
    camera = look((0, 0, 0), (0.3, 1.0, 0.4), ASPECT, 0.9)
    snapshot = floor(0.1, centre=(0, 0, -50), world=world)
    view = View.from_camera(camera, 0.1, 100)
    pixels, _ = drawn(snapshot, [], view, Shading())
    _, direction = pixel_rays(camera)
    face, row, column = direction_to_texel(direction.reshape(-1, 3), BACKGROUND_FACE)
    expected = world_texels(world, BACKGROUND_FACE)[face, row, column].reshape(HEIGHT, WIDTH, 3)
    same = np.isclose(pixels[..., :3], expected, rtol=1e-4).all(axis=2)
    assert same.mean() > 0.995  # rays on a texel's edge fall to either side
    assert not drawn(snapshot, [], view, Shading("NORMALS"))[0].any()


def test_traced_and_rasterised_pictures_are_the_same():
    """preview.png's way and the viewport's: holes, textures, every kind of light, soft shadows, a field."""
    snapshot = cluttered_room(clutter=12)
    grid = Grid.from_bounds((-1.5, -1.2, -1.0), (1.4, 1.3, 1.1), (4, 4, 3))
    field = random_field(9)
    field = Field(
        grid,
        *(getattr(field, name)[: grid.count] for name in ("coefficients", "state", "validity", "offset", "depth")),
        gradient=field.gradient[: grid.count],
    )
    camera = look((-1.3, -1.0, 0.6), (0.5, 0.4, -0.3), ASPECT, 0.7)
    textures = SceneTextures(snapshot, grid.center, sampling_density(snapshot, grid))
    traced, _ = PreviewPass(snapshot, textures, field, grid.center).render(camera, WIDTH, HEIGHT, 16)
    pixels, _ = drawn(snapshot, [field], View.from_camera(camera, 0.01, 50), Shading(), samples=16)
    assert (pixels[..., 3] == 1).all()
    difference = np.abs(standard_view(pixels[..., :3], -1.0) - standard_view(traced[..., :3], -1.0))
    blocks = difference.reshape(HEIGHT // 2, 2, WIDTH // 2, 2, 3).mean(axis=(1, 3))
    assert difference.mean() < 0.012
    assert (blocks.max(axis=2) < 0.05).mean() > 0.97


def test_samples_average_out_and_start_over():
    snapshot = floor(lights=[Light("lamp", "POINT", (3, 2, 1), frame((0.4, 0.6, 1.5)), radius=0.4)])
    view = View.from_camera(look((-1.5, -1.8, 1.4), (0, 0, 0), ASPECT, 0.5), 0.1, 100)
    drawing = ViewportPass(textures_of(snapshot, np.zeros(3)), np.zeros(3), 1, snapshot.world)
    picture = Picture(WIDTH, HEIGHT)
    drawing.draw(picture, view, Shading("DIRECT"), None)
    first = picture.read()
    for _ in range(7):
        drawing.draw(picture, view, Shading("DIRECT"), None)
    assert picture.samples == 8 and (picture.read()[HEIGHT // 4, :, 3] == 1).all()
    assert not np.array_equal(picture.read(), first)
    picture.samples = 0
    drawing.draw(picture, view, Shading("DIRECT"), None)
    np.testing.assert_array_equal(picture.read(), first)


def test_more_samples_are_taken_only_where_one_shows():
    snapshot = cluttered_room(clutter=12)
    origin = np.zeros(3)
    camera = look((-1.3, -1.0, 0.6), (0.5, 0.4, -0.3), ASPECT, 0.7)
    passes = PreviewPass(snapshot, textures_of(snapshot, origin), None, origin)
    one, _ = passes.render(camera, WIDTH, HEIGHT, 1)
    every, _ = passes.render(camera, WIDTH, HEIGHT, 6)
    chosen, _ = passes.render(camera, WIDTH, HEIGHT, 6, exposure=-4.0)
    rough = uneven(standard_view(one[..., :3], -4.0), 5 / 255)
    assert 0.05 < rough.mean() < 0.95
    np.testing.assert_array_equal(chosen[rough], every[rough])
    np.testing.assert_array_equal(chosen[~rough], one[~rough])
