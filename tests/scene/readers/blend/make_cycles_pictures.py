"""Run by Blender: writes NAME.blend and Cycles' picture of it, NAME.exr, for the scenes named after the folder."""

import math
import sys
from pathlib import Path

import bpy

SIDE = 96
SAMPLES = 64


def fresh(world=(0.3, 0.3, 0.3), strength=1.0):
    """A floor before an evenly lit world, and a camera that looks at the origin."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*world, 1.0)
    background.inputs["Strength"].default_value = strength
    camera = put("Camera", bpy.data.cameras.new("camera"), (0.0, -6.0, 2.0))
    camera.rotation_euler = (math.radians(72.0), 0.0, 0.0)
    scene.camera = camera
    floor = bpy.data.meshes.new("floor")
    floor.from_pydata([(-1.6, -1.6, 0), (1.6, -1.6, 0), (1.6, 1.6, 0), (-1.6, 1.6, 0)], [], [(0, 1, 2, 3)])
    floor.materials.append(paint("floor", color=(0.6, 0.6, 0.6)))
    put("Floor", floor)
    return scene


def put(name, data, location=(0.0, 0.0, 0.0), collection=None, **settings):
    item = bpy.data.objects.new(name, data)
    item.location = location
    for key, value in settings.items():
        setattr(item, key, value)
    (collection or bpy.context.scene.collection).objects.link(item)
    return item


def cube(name="cube", size=0.8, material=None):
    mesh = bpy.data.meshes.new(name)
    half = size / 2
    corners = [(x, y, z) for x in (-half, half) for y in (-half, half) for z in (-half, half)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh.from_pydata(corners, [], faces)
    mesh.uv_layers.new()
    if material is not None:
        mesh.materials.append(material)
    return mesh


def paint(name, color=(0.8, 0.2, 0.1), **inputs):
    """A Principled material; without highlights, unless they are asked for."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    shader = material.node_tree.nodes["Principled BSDF"]
    inputs = {"Specular IOR Level": 0.0, "Roughness": 1.0, **inputs}
    shader.inputs["Base Color"].default_value = (*color, 1.0)
    for key, value in inputs.items():
        shader.inputs[key].default_value = value
    return material


def light(kind, location=(0.0, 0.0, 3.0), rotation=(0.0, 0.0, 0.0), **settings):
    made = bpy.data.lights.new(kind, kind)
    if kind != "AREA":
        made.shadow_soft_size = 0.0  # sharp shadows
    for key, value in settings.items():
        if hasattr(made, key):  # some came with Blender 4.5 and 5
            setattr(made, key, value)
    return put(kind, made, location, rotation_euler=rotation)


def temperature():
    fresh(strength=0.0)
    put("Cube", cube(material=paint("red", (0.8, 0.4, 0.3))), (0.0, 0.0, 0.4))
    light("POINT", (1.0, -2.0, 3.0), energy=300.0, use_temperature=True, temperature=3000.0, exposure=1.0)


def not_normalized():
    fresh(strength=0.0)
    put("Cube", cube(), (0.0, 0.0, 0.4))
    light("SPOT", (0.0, 0.0, 4.0), energy=4000.0, normalize=False, shadow_soft_size=0.05, spot_size=0.9, spot_blend=0.5)


def lights():
    fresh(strength=0.0)
    put("Cube", cube(), (0.0, 0.0, 0.4))
    light("SUN", rotation=(0.5, 0.3, 0.0), energy=2.0, angle=0.0)
    light("AREA", (-2.0, -2.0, 3.0), (0.6, -0.6, 0.0), energy=60.0, shape="RECTANGLE", size=1.0, size_y=0.5)


def excluded():
    scene = fresh()
    put("Cube", cube(), (0.0, 0.0, 0.4))
    aside = bpy.data.collections.new("aside")
    scene.collection.children.link(aside)
    put("Backdrop", cube("backdrop", 3.0), (0.0, 4.0, 0.0), aside)
    bpy.context.view_layer.layer_collection.children["aside"].exclude = True


def pictured(*, space, is_float, colors=((0.5, 0.2, 0.1), (0.05, 0.3, 0.6))):
    """A plane with a picture of two colours, of numbers in a colour space."""
    fresh()
    picture = bpy.data.images.new("picture", 4, 4, float_buffer=is_float)
    picture.colorspace_settings.name = space
    picture.pixels[:] = [channel for color in colors for channel in (*color, 1.0) * 8]
    picture.pack()
    material = paint("pictured")
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.interpolation = picture, "Closest"
    tree.links.new(node.outputs["Color"], tree.nodes["Principled BSDF"].inputs["Base Color"])
    bpy.ops.mesh.primitive_plane_add(size=1.6, location=(0.0, 0.0, 0.8), rotation=(1.3, 0.0, 0.2))
    bpy.context.object.data.materials.append(material)


def linear_texture():
    pictured(space="Linear Rec.709", is_float=True)


def picture_of_another_space():
    pictured(space="ACEScg", is_float=False, colors=((0.5, 0.3, 0.2), (0.2, 0.3, 0.5)))


def work_in_acescg():
    if hasattr(bpy.data, "colorspace"):  # from Blender 5 on
        bpy.ops.wm.set_working_color_space(working_space="ACEScg", convert_colors=True)


def picture_in_working_space():
    pictured(space="Linear Rec.709", is_float=True)
    work_in_acescg()


def vertices_in_working_space():
    vertex_colors()
    work_in_acescg()


def working_space():
    fresh((0.3, 0.1, 0.1))
    put("Cube", cube(material=paint("red", (0.8, 0.1, 0.1))), (0.0, 0.0, 0.4))
    light("POINT", (1.0, -2.0, 3.0), energy=300.0, color=(1.0, 0.2, 0.2))
    work_in_acescg()


def shift():
    scene = fresh()
    put("Cube", cube(), (0.0, 0.0, 0.4))
    scene.camera.data.shift_x, scene.camera.data.shift_y = 0.2, -0.1


def tall():
    """A picture that is higher than wide, of which the camera's angle is that of the height."""
    scene = fresh()
    put("Cube", cube(), (0.0, 0.0, 0.4))
    scene.render.resolution_x = SIDE // 2
    scene.camera.data.shift_y = 0.1


def collections():
    fresh()
    group = bpy.data.collections.new("group")
    group.instance_offset = (0.1, 0.0, 0.0)
    put("Member", cube(size=0.4), (0.3, 0.0, 0.2), group)
    put("Other", cube(size=0.2, material=paint("blue", (0.1, 0.2, 0.8))), (-0.2, 0.0, 0.5), group)
    for x, turn, size in ((-1.0, 0.4, 1.0), (0.6, -0.5, 1.6)):
        put(
            f"Copy{x}",
            None,
            (x, 0.0, 0.0),
            rotation_euler=(0.0, 0.0, turn),
            scale=(size, size, -size if x < 0 else size),
            instance_type="COLLECTION",
            instance_collection=group,
        ).location.z = 1.0 if x < 0 else 0.0


def modifiers():
    fresh()
    item = put("Cube", cube(size=0.5), (-1.0, 0.0, 0.4))
    row = item.modifiers.new("row", "ARRAY")
    row.count, row.use_relative_offset, row.use_constant_offset = 3, False, True
    row.constant_offset_displace = (1.0, 0.0, 0.0)
    smooth = item.modifiers.new("smooth", "SUBSURF")
    smooth.levels, smooth.render_levels = 0, 2
    curve = bpy.data.curves.new("ring", "CURVE")
    curve.dimensions, curve.bevel_depth = "3D", 0.06
    line = curve.splines.new("POLY")
    line.points.add(3)
    for point, place in zip(line.points, ((-1, 0, 1), (-0.3, 0, 1.4), (0.3, 0, 1.0), (1, 0, 1.4)), strict=True):
        point.co = (*place, 1.0)
    put("Curve", curve)


def geometry_nodes():
    """Cubes on the corners of a grid, one larger than the other."""
    fresh()
    tree = bpy.data.node_groups.new("scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes, link = tree.nodes, tree.links.new
    grid, places = nodes.new("GeometryNodeMeshGrid"), nodes.new("GeometryNodeInstanceOnPoints")
    member, out = nodes.new("GeometryNodeObjectInfo"), nodes.new("NodeGroupOutput")
    grid.inputs["Size X"].default_value = grid.inputs["Size Y"].default_value = 2.0
    for name in ("Vertices X", "Vertices Y"):
        grid.inputs[name].default_value = 3
    member.inputs["Object"].default_value = put("Member", cube(size=0.4), hide_render=True)
    member.inputs["As Instance"].default_value = True
    places.inputs["Rotation"].default_value = (0.0, 0.0, 0.5)
    index = nodes.new("GeometryNodeInputIndex")
    scale = nodes.new("ShaderNodeMath")
    scale.operation = "MULTIPLY_ADD"
    scale.inputs[1].default_value, scale.inputs[2].default_value = 0.12, 0.2
    link(index.outputs[0], scale.inputs[0])
    link(scale.outputs[0], places.inputs["Scale"])
    link(grid.outputs["Mesh"], places.inputs["Points"])
    link(member.outputs["Geometry"], places.inputs["Instance"])
    link(places.outputs["Instances"], out.inputs[0])
    item = put("Scatter", bpy.data.meshes.new("scatter"), (0.0, 0.0, 0.3))
    item.modifiers.new("scatter", "NODES").node_group = tree


def principled():
    fresh((0.5, 0.5, 0.6))
    kinds = (
        {"Metallic": 1.0, "Roughness": 0.3, "Specular IOR Level": 0.5},
        {"Roughness": 0.4, "Specular IOR Level": 0.5},
        {"Emission Color": (0.1, 0.9, 0.2, 1.0), "Emission Strength": 3.0},
        {"Alpha": 0.4},
    )
    for number, kind in enumerate(kinds):
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.35, location=(0.8 * (number - 1.5), 0.0, 0.4))
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(paint(f"kind {number}", (0.8, 0.5, 0.2), **kind))


def vertex_colors():
    fresh()
    material = paint("painted")
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = "Col"
    tree.links.new(node.outputs["Color"], tree.nodes["Principled BSDF"].inputs["Base Color"])
    mesh = cube(size=1.0, material=material)
    colors = mesh.color_attributes.new("Col", "FLOAT_COLOR", "POINT")
    for number, value in enumerate(colors.data):
        value.color = (number & 1, (number >> 1) & 1, 0.5, 1.0)
    put("Cube", mesh, (0.0, 0.0, 0.5), rotation_euler=(0.0, 0.0, 0.5))


def unseen():
    """Objects that cameras do not see: rays of the camera pass them, light does not."""
    fresh()
    put("Cube", cube(), (0.0, 0.0, 0.4))
    put("Ghost", cube("ghost", 0.6), (0.9, -0.8, 0.3), visible_camera=False)


def slots():
    """Materials of objects, not of their meshes; instances on the corners of a parent; texts."""
    fresh()
    mesh = cube(size=0.5, material=paint("of the mesh"))
    for x, color in ((-0.9, (0.1, 0.6, 0.1)), (0.9, (0.1, 0.1, 0.7))):
        item = put(f"Cube{x}", mesh, (x, 0.0, 0.3))
        item.material_slots[0].link = "OBJECT"
        item.material_slots[0].material = paint(f"of the object {x}", color)
    corners = bpy.data.meshes.new("corners")
    corners.from_pydata([(-0.3, 0, 1), (0.3, 0, 1), (0, 0, 1.5)], [], [(0, 1, 2)])
    parent = put("Parent", corners, instance_type="VERTS", show_instancer_for_render=False)
    put("Child", cube("child", 0.2, paint("child")), parent=parent)
    text = bpy.data.curves.new("text", "FONT")
    text.body, text.extrude, text.size = "Li", 0.05, 0.8
    put("Text", text, (-0.35, 0.0, 0.1), rotation_euler=(1.4, 0.0, 0.0)).data.materials.append(paint("text"))


SCENES = {
    make.__name__: make
    for make in (
        temperature,
        not_normalized,
        lights,
        excluded,
        linear_texture,
        picture_of_another_space,
        picture_in_working_space,
        vertices_in_working_space,
        working_space,
        shift,
        tall,
        collections,
        modifiers,
        geometry_nodes,
        principled,
        vertex_colors,
        unseen,
        slots,
    )
}


def set_up(scene):
    """Let Cycles make a small picture in linear Rec. 709, with all of its light."""
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    if render.resolution_x == 1920:
        render.resolution_x = SIDE
    render.resolution_y, render.resolution_percentage = SIDE, 100
    render.threads_mode, render.threads = "FIXED", 1
    cycles.device, cycles.samples, cycles.seed = "CPU", SAMPLES, 1
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width, cycles.blur_glossy = 1.0, 0.0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.diffuse_bounces = cycles.glossy_bounces = cycles.max_bounces = 8
    settings = render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    settings.color_management = "OVERRIDE"
    settings.linear_colorspace_settings.name = "Linear Rec.709"


if __name__ == "__main__":
    words = sys.argv[sys.argv.index("--") + 1 :]
    for name in words[1:] or SCENES:
        SCENES[name]()
        set_up(bpy.context.scene)
        bpy.context.view_layer.update()
        path = Path(words[0], f"{name}.blend")
        bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)
        bpy.ops.wm.open_mainfile(filepath=str(path))  # as any program finds it
        bpy.context.scene.render.filepath = str(path.with_suffix(".exr"))
        bpy.ops.render.render(write_still=True)
