"""Run by Blender: writes files for tests into the folder of the last word."""

import sys
from pathlib import Path

import bpy

FOLDER = Path(sys.argv[-1])


def fresh():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    return scene


def put(scene, name, data, location=(0.0, 0.0, 0.0), **settings):
    item = bpy.data.objects.new(name, data)
    item.location = location
    for key, value in settings.items():
        setattr(item, key, value)
    scene.collection.objects.link(item)
    return item


def cube(name="cube", size=1.0):
    mesh = bpy.data.meshes.new(name)
    half = size / 2
    corners = [(x, y, z) for x in (-half, half) for y in (-half, half) for z in (-half, half)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    mesh.from_pydata(corners, [], faces)
    return mesh


def light(kind, **settings):
    made = bpy.data.lights.new(kind, kind)
    for key, value in settings.items():
        setattr(made, key, value)
    return made


def save(name):
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / name), check_existing=False)


def everything():
    scene = fresh()
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.1, 0.2, 0.4, 1.0)
    background.inputs["Strength"].default_value = 0.5

    put(scene, "Spare", bpy.data.cameras.new("spare"))
    scene.camera = put(
        scene, "Active", bpy.data.cameras.new("active"), (0.0, -5.0, 1.0), rotation_euler=(1.4, 0.0, 0.0)
    )
    scene.camera.data.dof.use_dof = True
    scene.camera.data.dof.focus_distance = 4.0

    put(scene, "Bulb", light("POINT", energy=100.0, color=(1.0, 0.5, 0.25)), (1.0, 2.0, 3.0))
    put(scene, "Cone", light("SPOT", energy=50.0, spot_size=1.0, spot_blend=0.5))
    put(scene, "Sky", light("SUN", energy=3.0))
    put(scene, "Panel", light("AREA", energy=10.0, shape="RECTANGLE", size=2.0, size_y=0.5), scale=(2.0, 2.0, 2.0))
    put(scene, "Disc", light("AREA", energy=10.0, shape="DISK", size=2.0, spread=1.0))

    put(scene, "Seen", cube("seen"), hide_viewport=True)
    put(scene, "Unseen", cube("unseen"), hide_render=True)
    smooth = put(scene, "Smooth", cube("smooth")).modifiers.new("smooth", "SUBSURF")
    smooth.levels, smooth.render_levels = 0, 2

    collection = bpy.data.collections.new("group")
    collection.objects.link(bpy.data.objects.new("Member", cube("member")))
    for place in (1.0, 2.0, 3.0):
        put(scene, f"Copy{place:g}", None, (place, 0, 0), instance_type="COLLECTION", instance_collection=collection)

    noisy = bpy.data.materials.new("noisy")
    noisy.use_nodes = True
    nodes = noisy.node_tree.nodes
    noise = nodes.new("ShaderNodeTexNoise")
    noisy.node_tree.links.new(noise.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    mesh = cube("rough")
    mesh.materials.append(noisy)
    put(scene, "Rough", mesh)
    put(scene, "Fog", bpy.data.volumes.new("fog"))
    scene.view_settings.exposure = 1.5
    save("everything.blend")


def moving():
    scene = fresh()
    scene.unit_settings.scale_length = 0.01
    scene.render.fps = 10
    scene.frame_start, scene.frame_end = 1, 11
    item = put(scene, "Cube", cube("cube", 100.0))
    item.keyframe_insert("location", frame=1)
    item.location.z = 200.0
    item.keyframe_insert("location", frame=11)
    put(scene, "Bulb", light("POINT", energy=4.0e4), (0.0, 0.0, 300.0))
    scene.camera = put(scene, "Camera", bpy.data.cameras.new("camera"), (0.0, -500.0, 0.0), rotation_euler=(1.57, 0, 0))
    scene.camera.data.dof.use_dof = True
    scene.camera.data.dof.focus_distance = 500.0

    # Red to the right (+x) of who looks along +y, green ahead, blue straight up.
    picture = bpy.data.images.new("sky", 64, 32, float_buffer=True)
    pixels = []
    for row in range(32):
        for column in range(64):
            color = (0.0, 0.0, 1.0) if row >= 30 else (0.0, 1.0, 0.0) if 28 <= column < 36 else (0.0, 0.0, 0.0)
            pixels += [*((1.0, 0.0, 0.0) if 44 <= column < 52 and row < 30 else color), 1.0]
    picture.pixels[:] = pixels
    picture.pack()
    tree = scene.world.node_tree
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = picture
    mapping = tree.nodes.new("ShaderNodeMapping")
    place = tree.nodes.new("ShaderNodeTexCoord")
    # Blender has the middle of such a picture at +x: turned so that it lies at +y.
    mapping.inputs["Rotation"].default_value[2] = -1.5707963
    tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    save("moving.blend")


def outside():
    scene = fresh()
    put(scene, "Cube", cube())
    picture = bpy.data.images.new("secret", 4, 4)
    picture.filepath_raw = str(FOLDER.parent / "secret.png")
    picture.file_format = "PNG"
    picture.save()
    picture = bpy.data.images.load(str(FOLDER.parent / "secret.png"))
    picture.use_fake_user = True
    save("outside.blend")


def empty():
    fresh()
    save("empty.blend")


def shader_of(material):
    material.use_nodes = True
    return material.node_tree.nodes["Principled BSDF"]


def aside():
    """A backdrop in a collection that is put aside, and one that is put aside but shown by an instance."""
    scene = fresh()
    put(scene, "Cube", cube())
    for name in ("kept", "shown"):
        collection = bpy.data.collections.new(name)
        scene.collection.children.link(collection)
        collection.objects.link(bpy.data.objects.new(f"{name} member", cube(f"{name} member", 9.0)))
        bpy.context.view_layer.layer_collection.children[name].exclude = True
    put(scene, "Copy", None, (3, 0, 0), instance_type="COLLECTION", instance_collection=bpy.data.collections["shown"])
    bpy.context.view_layer.update()
    save("aside.blend")


def pictures():
    """One colour as linear numbers and as codes, and roughness 0.5 as numbers and as a picture of codes."""
    scene = fresh()
    kinds = {
        "float": ((0.5, 0.2, 0.1), {"float_buffer": True}, "Linear Rec.709", "Base Color"),
        "linear": ((0.5, 0.2, 0.1), {}, "Non-Color", "Base Color"),
        "codes": ((0.735, 0.484, 0.349), {}, "sRGB", "Base Color"),
        "rough": ((0.5, 0.5, 0.5), {}, "Non-Color", "Roughness"),
        "rough codes": ((0.735, 0.735, 0.735), {}, "sRGB", "Roughness"),
    }
    for place, (name, (color, kind, space, socket)) in enumerate(kinds.items()):
        picture = bpy.data.images.new(name, 4, 4, **kind)
        picture.colorspace_settings.name = space
        picture.pixels[:] = [*color, 1.0] * 16
        picture.pack()
        material = bpy.data.materials.new(name)
        shader, tree = shader_of(material), material.node_tree
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = picture
        tree.links.new(node.outputs["Color"], shader.inputs[socket])
        mesh = cube(name)
        mesh.uv_layers.new()
        mesh.materials.append(material)
        put(scene, name, mesh, (2.0 * place, 0.0, 0.0))
    save("pictures.blend")


def surfaces():
    """Materials of one node that is no Principled BSDF, with a colour or a picture."""
    scene = fresh()
    picture = bpy.data.images.new("picture", 4, 4)
    picture.pack()
    for place, kind in enumerate(("Diffuse", "Glossy", "Glass")):
        material = bpy.data.materials.new(kind)
        shader_of(material)
        tree = material.node_tree
        node = tree.nodes.new(f"ShaderNodeBsdf{'Anisotropic' if kind == 'Glossy' else kind}")
        node.inputs["Color"].default_value = (0.8, 0.2, 0.1, 1.0)
        node.inputs["Roughness"].default_value = 0.25
        if kind == "Diffuse":
            texture = tree.nodes.new("ShaderNodeTexImage")
            texture.image = picture
            tree.links.new(texture.outputs["Color"], node.inputs["Color"])
        tree.links.new(node.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
        mesh = cube(kind)
        mesh.uv_layers.new()
        mesh.materials.append(material)
        put(scene, kind, mesh, (2.0 * place, 0.0, 0.0))
    save("surfaces.blend")


def mixed():
    """Surfaces of several nodes, and nodes between a picture and a surface."""
    scene = fresh()
    pictures = {}
    for name, left, right in (("mask", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)), ("colors", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))):
        pictures[name] = picture = bpy.data.images.new(name, 4, 4)
        picture.pixels[:] = [*left, 1.0, *left, 1.0, *right, 1.0, *right, 1.0] * 4
        picture.pack()

    def use(name):
        """A material on a cube of its own, and a function that adds nodes to it."""
        material = bpy.data.materials.new(name)
        shader_of(material)
        tree = material.node_tree

        def add(kind, inputs, **settings):
            node = tree.nodes.new(f"ShaderNode{kind}")
            for key, value in settings.items():
                setattr(node, key, value)
            for key, value in inputs.items():
                if hasattr(value, "is_output"):
                    tree.links.new(value, node.inputs[key])
                else:
                    node.inputs[key].default_value = value
            return node.outputs[0]

        mesh = cube(name)
        mesh.uv_layers.new()
        mesh.materials.append(material)
        put(scene, name, mesh, (2.0 * len(scene.objects), 0.0, 0.0))
        return add, lambda surface: tree.links.new(surface, tree.nodes["Material Output"].inputs["Surface"])

    red, green, white = (0.8, 0.1, 0.1, 1.0), (0.1, 0.8, 0.1, 1.0), (1.0, 1.0, 1.0, 1.0)
    for name, factor in (("half", None), ("plastic", "Fresnel"), ("masked", "TexImage"), ("leaf", "TexImage")):
        add, show = use(name)
        one = add("BsdfTransparent", {}) if name == "leaf" else add("BsdfDiffuse", {"Color": red})
        kind = "BsdfAnisotropic" if name in ("plastic", "masked") else "BsdfDiffuse"
        other = add(kind, {"Color": white if name == "plastic" else green, "Roughness": 0.25})
        share = 0.5 if factor is None else add(factor, {"IOR": 1.4} if factor == "Fresnel" else {})
        if factor == "TexImage":
            share.node.image = pictures["mask"]
        show(add("MixShader", {0: share, 1: one, 2: other}))

    add, show = use("glow")
    lit = add("Emission", {"Color": green, "Strength": 4.0})
    show(add("AddShader", {0: add("BsdfDiffuse", {"Color": red}), 1: lit}))
    add, show = use("inverted")
    show(add("BsdfDiffuse", {"Color": add("Invert", {"Color": add("TexImage", {}, image=pictures["colors"])})}))
    add, show = use("lost")
    lost = bpy.data.images.new("lost", 4, 4)
    lost.source, lost.filepath = "FILE", "//lost.png"
    show(add("BsdfPrincipled", {"Base Color": add("TexImage", {}, image=lost)}))
    add, show = use("noise")
    show(add("BsdfDiffuse", {"Color": add("TexNoise", {})}))
    add, show = use("bumped")
    height = add("TexImage", {}, image=pictures["mask"])
    show(add("BsdfPrincipled", {"Normal": add("Bump", {"Height": height, "Distance": 0.5})}))

    inner = bpy.data.node_groups.new("inner", "ShaderNodeTree")
    inner.interface.new_socket("Color", in_out="INPUT", socket_type="NodeSocketColor")
    inner.interface.new_socket("Surface", in_out="OUTPUT", socket_type="NodeSocketShader")
    start, end, change, surface = (
        inner.nodes.new(kind)
        for kind in ("NodeGroupInput", "NodeGroupOutput", "ShaderNodeInvert", "ShaderNodeBsdfDiffuse")
    )
    for output, entry in (
        (start.outputs[0], change.inputs["Color"]),
        (change.outputs[0], surface.inputs["Color"]),
        (surface.outputs[0], end.inputs[0]),
    ):
        inner.links.new(output, entry)
    add, show = use("grouped")
    show(add("Group", {}, node_tree=inner))
    group = bpy.data.materials["grouped"].node_tree.nodes["Group"]
    group.inputs[0].default_value = (0.2, 0.9, 0.9, 1.0)
    save("mixed.blend")


def posed():
    """A cube on a bone that is turned by a quarter at the present frame, and at rest at the first one."""
    scene = fresh()
    rig = put(scene, "Rig", bpy.data.armatures.new("rig"))
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    bone = rig.data.edit_bones.new("bone")
    bone.head, bone.tail = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    bpy.ops.object.mode_set(mode="OBJECT")
    rig.pose.bones["bone"].rotation_mode = "XYZ"
    rig.pose.bones["bone"].keyframe_insert("rotation_euler", frame=1)
    rig.pose.bones["bone"].rotation_euler = (1.5707963, 0.0, 0.0)
    rig.pose.bones["bone"].keyframe_insert("rotation_euler", frame=5)
    scene.frame_set(5)
    mesh = cube()
    for vertex in mesh.vertices:
        vertex.co.z += 3.0
    item = put(scene, "Cube", mesh, parent=rig)
    item.vertex_groups.new(name="bone").add(range(8), 1.0, "REPLACE")
    item.modifiers.new("rig", "ARMATURE").object = rig
    save("posed.blend")


def lights():
    scene = fresh()
    put(scene, "Cube", cube())
    for name, kind, settings in (
        ("warm", "POINT", {"use_temperature": True, "temperature": 3000.0}),
        ("sized", "SPOT", {"normalize": False, "shadow_soft_size": 0.5}),
    ):
        made = light(kind, energy=100.0)
        for key, value in settings.items():
            if hasattr(made, key):  # from Blender 4.5 on
                setattr(made, key, value)
        put(scene, name, made)
    save("lights.blend")


def shifted():
    scene = fresh()
    put(scene, "Cube", cube())
    for name, kind in (("lens", "PERSP"), ("flat", "ORTHO")):
        camera = bpy.data.cameras.new(name)
        camera.type, camera.lens, camera.sensor_width, camera.ortho_scale = kind, 50.0, 36.0, 6.0
        camera.shift_x, camera.shift_y = 0.1, -0.05
        put(scene, name, camera, (0.0, -5.0, 0.0), rotation_euler=(1.5707963, 0.0, 0.0))
    save("shifted.blend")


def otherwise():
    """What renders show and displays do not, or otherwise."""
    scene = fresh()
    scene.render.film_transparent = True
    holes = bpy.data.collections.new("holes")
    scene.collection.children.link(holes)
    holes.objects.link(bpy.data.objects.new("Hole", cube("hole")))
    layer = bpy.context.view_layer
    layer.layer_collection.children["holes"].holdout = True
    layer.material_override = bpy.data.materials.new("clay")
    put(scene, "Catcher", cube("catcher"), is_shadow_catcher=True)
    put(scene, "Ghost", cube("ghost"), visible_camera=False)
    lamp = put(scene, "Oval", light("SPOT", energy=50.0), scale=(2.0, 1.0, 1.0))
    lamp.light_linking.receiver_collection = holes

    material = bpy.data.materials.new("mixed")
    shader, tree = shader_of(material), material.node_tree
    mix, clear, node = (tree.nodes.new(f"ShaderNode{name}") for name in ("MixShader", "BsdfTransparent", "TexImage"))
    node.image, node.extension = bpy.data.images.new("decal", 4, 4), "CLIP"
    tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    tree.links.new(clear.outputs[0], mix.inputs[1])
    tree.links.new(shader.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    mesh = cube("mixed")
    mesh.materials.append(material)
    put(scene, "Mixed", mesh)
    if hasattr(scene, "compositing_node_group"):  # from Blender 5 on
        scene.compositing_node_group = bpy.data.node_groups.new("compositor", "CompositorNodeTree")
        scene.compositing_node_group.nodes.new("CompositorNodeBlur")
    else:
        scene.use_nodes = True
        scene.node_tree.nodes.new("CompositorNodeBlur")
    save("otherwise.blend")


def flat():
    """An orthographic camera in a file of centimetres, for pictures of pixels that are not square."""
    scene = fresh()
    scene.unit_settings.scale_length = 0.01
    put(scene, "Cube", cube("cube", 100.0))
    camera = bpy.data.cameras.new("flat")
    camera.type, camera.ortho_scale = "ORTHO", 300.0
    scene.camera = put(scene, "flat", camera, (0.0, -500.0, 0.0), rotation_euler=(1.5707963, 0.0, 0.0))
    scene.render.resolution_x = scene.render.resolution_y = 96
    scene.render.pixel_aspect_x = 2.0
    save("flat.blend")


def working_spaces():
    """One scene in three working spaces; before Blender 5 there is but one."""
    for space in ("Linear Rec.709", "Linear Rec.2020", "ACEScg"):
        scene = fresh()
        background = scene.world.node_tree.nodes["Background"]
        background.inputs["Color"].default_value = (0.9, 0.2, 0.2, 1.0)
        material = bpy.data.materials.new("red")
        shader = shader_of(material)
        shader.inputs["Base Color"].default_value = (0.8, 0.1, 0.1, 1.0)
        shader.inputs["Emission Color"].default_value = (0.1, 0.9, 0.2, 1.0)
        shader.inputs["Emission Strength"].default_value = 3.0
        mesh = cube()
        mesh.materials.append(material)
        put(scene, "Cube", mesh)
        put(scene, "Bulb", light("POINT", energy=100.0, color=(1.0, 0.2, 0.2)))
        if space != "Linear Rec.709" and hasattr(bpy.data, "colorspace"):
            bpy.ops.wm.set_working_color_space(working_space=space, convert_colors=True)
        save(f"{space.split()[-1]}.blend")


for make in (
    everything,
    moving,
    outside,
    empty,
    aside,
    pictures,
    surfaces,
    mixed,
    posed,
    lights,
    shifted,
    otherwise,
    flat,
    working_spaces,
):
    make()
