# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates the colour and number nodes of a shader tree per pixel of the textures that feed them.

Nodes that depend on the ray are answered for what a probe bake traces: diffuse rays, averaged over directions with the
cosine.
"""

from __future__ import annotations

import bpy
import numpy as np

from . import shader_math
from .blackbody import blackbody_color
from .images import ImageTable
from .node_links import Reported, Scope, Unsupported, find_socket, resolve
from .notices import Notices
from .ray_nodes import RAY_NODES, Viewer
from .shader_values import SCATTERED, Value, apply, as_number, blend, constant, mixed_domains
from .texture_coordinates import domain_of


class NodeEvaluator:
    """Values of the sockets of one material, world or light tree.

    Args:
        owner: names the tree in warnings, such as ``material 'Floor'``.
        owner_name: the datablock's name alone, for warnings that list several.
        sample: answers for outputs that have no counterpart here; called with the evaluator, the socket and its scope,
            it returns a Value or raises Unsupported. Without it they are not supported.
        viewer: who asks.
    """

    def __init__(
        self,
        owner: str,
        images: ImageTable,
        notices: Notices,
        owner_name: str,
        sample=None,
        viewer: Viewer = Viewer(),
    ):
        self.sample = sample
        self.owner = owner
        self.owner_name = owner_name
        self.images = images
        self.notices = notices
        self.viewer = viewer
        self.asks_side = False  # from behind the answer may be another one
        self.asks_kind = False  # to shadow rays, too
        self.loses_pattern = False  # something that changes over the surface entered with one value
        self._values: dict[tuple, Value] = {}

    def input(self, node: bpy.types.Node, name: str, scope: Scope | None) -> Value:
        """Value of the input called ``name``. Where its source is not supported, the input's own value and a
        warning."""
        socket = find_socket(node.inputs, name)
        if socket is None:
            raise Unsupported(f"it has no input '{name}' in this Blender")
        source, source_scope = resolve(socket, scope)
        try:
            value = self.output(source, source_scope) if source.is_output else default_value(source)
        except Unsupported as reason:
            if not isinstance(reason, Reported):
                self.loses_pattern = True
                self.notices.append(
                    f"{self.owner}: node '{source.node.name}' feeding '{socket.name}' of '{node.name}' is not "
                    f"supported ({reason}); that input's own value is used"
                )
            value = default_value(socket)
        if socket.type == "VALUE":
            value = _mean_of_channels(value) if source.type == "VECTOR" else as_number(value)
        return value

    def linked(self, node: bpy.types.Node, name: str, scope: Scope | None) -> bool:
        """Whether something computes that input."""
        return resolve(find_socket(node.inputs, name), scope)[0].is_output

    def output(self, socket: bpy.types.NodeSocket, scope: Scope | None) -> Value:
        """Value of an output socket.

        Raises:
            Unsupported: with the reason.
        """
        key = (socket.as_pointer(), scope)
        if key not in self._values:
            evaluate = _NODES.get(socket.node.bl_idname, _no_counterpart)
            try:
                self._values[key] = evaluate(self, socket.node, socket, scope)
            except Reported:
                raise
            except Unsupported:
                if self.sample is None:
                    raise
                self._values[key] = self.sample(self, socket, scope)
        return self._values[key]

    def per_pixel(self, node, scope, function, *names: str) -> Value:
        """``function`` of the named inputs, with a warning where textures with different mappings meet."""
        return self.joined(node, function, *(self.input(node, name, scope) for name in names))

    def joined(self, node, function, *values: Value) -> Value:
        """``function`` of ``values`` that meet in ``node``, with the same warning."""
        if mixed_domains(*values):
            self.loses_pattern = True
            self.notices.append(
                f"{self.owner}: node '{node.name}' joins textures with different mappings; "
                "only one keeps its pattern, the others are averaged"
            )
        return apply(function, *values)


def default_value(socket: bpy.types.NodeSocket) -> Value:
    """A socket's own value.

    Raises:
        Unsupported: the socket carries none, as shader sockets do.
    """
    if socket.type == "RGBA":
        return constant(socket.default_value[:3])
    if socket.type == "VECTOR":
        return constant(socket.default_value[:3])
    if socket.type in ("VALUE", "INT", "BOOLEAN"):
        return constant(float(socket.default_value))
    raise Unsupported(f"'{socket.name}' carries no value")


def _mean_of_channels(value: Value) -> Value:
    return apply(lambda array: array.mean(axis=-1, keepdims=True), value)


def _no_counterpart(evaluator, node, socket, scope):
    raise Unsupported(f"{node.bl_label} has no counterpart here")


def _rgb(array: np.ndarray) -> np.ndarray:
    return np.broadcast_to(array, (*array.shape[:-1], 3))


def _image_texture(evaluator, node, socket, scope):
    owner = evaluator.owner
    if node.image is None:
        raise Unsupported("no image is chosen")
    pixels = evaluator.images.pixels(node.image, owner, node.interpolation, node.extension)
    if pixels is None:
        raise Reported("its image is missing")
    try:
        if node.projection != "FLAT":
            raise Unsupported(f"{node.projection.lower()} projection")
        domain = domain_of(evaluator, find_socket(node.inputs, "Vector"), scope, node.extension)
    except Unsupported as reason:
        evaluator.loses_pattern = True
        evaluator.notices.append(
            f"{owner}: the mapping of image '{node.image.name}' is not supported ({reason}); its mean colour is used"
        )
        domain = SCATTERED
    color, alpha = evaluator.images.channels(pixels)
    cover = Value(np.ones(1, np.float32), alpha, domain)
    if socket.name == "Alpha":
        return cover
    value = Value(np.ones(1, np.float32), color, domain)
    # Cycles keeps the premultiplied colour where nobody asks for the alpha.
    if (
        node.image.alpha_mode in ("STRAIGHT", "PREMUL")
        and not find_socket(node.outputs, "Alpha").is_linked
        and cover.least() < 1
    ):
        value = apply(np.multiply, value, cover)
    return value


def _mix(evaluator, node, socket, scope):
    if node.data_type == "FLOAT":
        names, factor_name = ("A_Float", "B_Float"), "Factor_Float"
    elif node.data_type == "VECTOR":
        names = ("A_Vector", "B_Vector")
        factor_name = "Factor_Float" if node.factor_mode == "UNIFORM" else "Factor_Vector"
    elif node.data_type == "RGBA":
        names, factor_name = ("A_Color", "B_Color"), "Factor_Float"
    else:
        raise Unsupported("it mixes rotations")
    blend_type = node.blend_type if node.data_type == "RGBA" else "MIX"
    return _mixed(
        evaluator,
        node,
        scope,
        (factor_name, *names),
        blend_type,
        node.clamp_factor,
        node.data_type == "RGBA" and node.clamp_result,
    )


def _mix_rgb(evaluator, node, socket, scope):
    return _mixed(evaluator, node, scope, ("Fac", "Color1", "Color2"), node.blend_type, True, node.use_clamp)


def _mixed(evaluator, node, scope, names, blend_type, clamp_factor, clamp_result):
    factor, first, second = (evaluator.input(node, name, scope) for name in names)
    if clamp_factor:
        factor = apply(lambda f: np.clip(f, 0, 1), factor)
    if (
        blend_type == "MIX"
        and factor.is_constant
        and not clamp_result
        and (first.is_constant or second.is_constant or factor.scale[0] in (0, 1))
    ):
        return blend(factor, first, second)  # keeps an untouched texture one shared array

    def mix(f, a, b):
        result = shader_math.mix(blend_type, f, a, b)
        return np.clip(result, 0, 1) if clamp_result else result

    if blend_type == "MULTIPLY" and factor.is_constant and float(factor.scale[0]) == 1 and not clamp_result:
        if first.is_constant:
            return second.scaled(first.scale)
        if second.is_constant:
            return first.scaled(second.scale)
    return evaluator.joined(node, mix, factor, first, second)


def _math(evaluator, node, socket, scope):
    if node.operation not in shader_math.MATH:
        raise Unsupported(f"operation {node.operation}")
    operation = shader_math.MATH[node.operation]

    def function(a, b, c):
        result = np.nan_to_num(operation(a, b, c), nan=0.0, posinf=0.0, neginf=0.0)
        return np.clip(result, 0, 1) if node.use_clamp else result

    identifiers = [socket.identifier for socket in node.inputs]
    return evaluator.per_pixel(node, scope, function, *identifiers)


def _color_ramp(evaluator, node, socket, scope):
    factor = evaluator.input(node, "Fac", scope)
    table = np.array([node.color_ramp.evaluate(position)[:] for position in np.linspace(0, 1, 257)], np.float32)
    table = table[:, 3:] if socket.name == "Alpha" else table[:, :3]
    return apply(lambda f: _look_up(table, f[..., 0]), factor)


def _look_up(table: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Linear interpolation in ``table`` (257, channels) at ``position`` 0..1."""
    scaled = np.clip(position, 0, 1) * 256
    low = np.minimum(scaled.astype(int), 255)
    share = (scaled - low)[..., None]
    return table[low] * (1 - share) + table[low + 1] * share


def _rgb_curves(evaluator, node, socket, scope):
    mapping = node.mapping
    mapping.initialize()
    combined, channels = mapping.curves[3], mapping.curves[:3]
    grid = np.linspace(0, 1, 257)
    tables = [
        np.array([[mapping.evaluate(curve, mapping.evaluate(combined, x))] for x in grid], np.float32)
        for curve in channels
    ]

    def function(factor, color):
        color = _rgb(color)
        curved = np.concatenate([_look_up(table, color[..., index]) for index, table in enumerate(tables)], axis=-1)
        return color * (1 - factor) + curved * factor

    return evaluator.per_pixel(node, scope, function, "Fac", "Color")


def _float_curve(evaluator, node, socket, scope):
    node.mapping.initialize()
    table = np.array([[node.mapping.evaluate(node.mapping.curves[0], x)] for x in np.linspace(0, 1, 257)], np.float32)
    return evaluator.per_pixel(
        node,
        scope,
        lambda factor, value: value * (1 - factor) + _look_up(table, value[..., 0]) * factor,
        "Factor",
        "Value",
    )


def _map_range(evaluator, node, socket, scope):
    if node.data_type != "FLOAT" or node.interpolation_type == "STEPPED":
        raise Unsupported("only Float without steps")
    return evaluator.per_pixel(
        node,
        scope,
        lambda x, a, b, c, d: shader_math.map_range(x, a, b, c, d, node.interpolation_type, node.clamp),
        "Value",
        "From Min",
        "From Max",
        "To Min",
        "To Max",
    )


def _clamp(evaluator, node, socket, scope):
    def function(value, low, high):
        if node.clamp_type == "RANGE":
            low, high = np.minimum(low, high), np.maximum(low, high)
        return np.minimum(np.maximum(value, low), high)

    return evaluator.per_pixel(node, scope, function, "Value", "Min", "Max")


def _separate(evaluator, node, socket, scope):
    channel = [item.identifier for item in node.outputs].index(socket.identifier)
    mode = getattr(node, "mode", "RGB")
    if mode == "HSL":
        raise Unsupported("HSL")
    split = shader_math.rgb_to_hsv if mode == "HSV" else _rgb
    return evaluator.per_pixel(
        node, scope, lambda color: split(color)[..., channel : channel + 1], node.inputs[0].identifier
    )


def _combine(evaluator, node, socket, scope):
    mode = getattr(node, "mode", "RGB")
    if mode == "HSL":
        raise Unsupported("HSL")

    def function(a, b, c):
        joined = np.concatenate(np.broadcast_arrays(a, b, c), axis=-1)
        return shader_math.hsv_to_rgb(joined) if mode == "HSV" else joined

    return evaluator.per_pixel(node, scope, function, *(item.identifier for item in node.inputs))


_NODES = {
    "ShaderNodeRGB": lambda e, node, socket, scope: constant(node.outputs[0].default_value[:3]),
    "ShaderNodeValue": lambda e, node, socket, scope: constant(node.outputs[0].default_value),
    "ShaderNodeTexImage": _image_texture,
    "ShaderNodeMix": _mix,
    "ShaderNodeMixRGB": _mix_rgb,
    "ShaderNodeGamma": lambda e, node, socket, scope: e.per_pixel(node, scope, shader_math.gamma, "Color", "Gamma"),
    "ShaderNodeBrightContrast": lambda e, node, socket, scope: e.per_pixel(
        node, scope, shader_math.bright_contrast, "Color", "Bright", "Contrast"
    ),
    "ShaderNodeHueSaturation": lambda e, node, socket, scope: e.per_pixel(
        node, scope, shader_math.hue_saturation, "Hue", "Saturation", "Value", "Fac", "Color"
    ),
    "ShaderNodeInvert": lambda e, node, socket, scope: e.per_pixel(node, scope, shader_math.invert, "Fac", "Color"),
    "ShaderNodeValToRGB": _color_ramp,
    "ShaderNodeRGBCurve": _rgb_curves,
    "ShaderNodeFloatCurve": _float_curve,
    "ShaderNodeMath": _math,
    "ShaderNodeMapRange": _map_range,
    "ShaderNodeClamp": _clamp,
    "ShaderNodeSeparateColor": _separate,
    "ShaderNodeSeparateRGB": _separate,
    "ShaderNodeSeparateXYZ": _separate,
    "ShaderNodeCombineColor": _combine,
    "ShaderNodeCombineRGB": _combine,
    "ShaderNodeCombineXYZ": _combine,
    "ShaderNodeRGBToBW": lambda e, node, socket, scope: as_number(e.input(node, "Color", scope)),
    "ShaderNodeBlackbody": lambda e, node, socket, scope: constant(
        blackbody_color(e.input(node, "Temperature", scope).number())
    ),
    **RAY_NODES,
}
