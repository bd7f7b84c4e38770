#!/usr/bin/env bash
# trimesh: a 3MF package loses its colours, and becomes a glTF file that is 39 or 1000 times too large.
#
# Versions: trimesh 5.2.0 (PyPI) with lxml and networkx, Python 3.
# Believed: trimesh, which reads 3MF and writes glTF, keeps the colours of a model's materials (3MF Core Specification
#   1.3, 5.1: sRGB `displaycolor`), and minds the unit: a package says it, and glTF is in metres (glTF 2.0, 3.4).
# What happens: materials and colour groups are passed over without a word; surfaces have no visual at all. The unit is
#   read, and noted in `scene.units`, but export writes the numbers as they stand: 6 inches become 6 metres.
# Who is hurt: whoever brings printable models to viewers, phones and light-field displays by way of trimesh: they are
#   grey, and stand in augmented reality as large as houses.
# Seen: "colours: [None], unit inch, 6.0 inches wide, 6.0 metres in glTF".
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check trimesh==5.2.0 lxml networkx
cd "$folder"
"$folder/venv/bin/python" - <<'PYTHON'
import json
import struct
import sys
import zipfile

import trimesh

RELATIONS = """<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Id="r" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel" Target="/3D/3dmodel.model"/>
</Relationships>"""
TYPES = """<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>"""
MODEL = """<model unit="inch" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>
<basematerials id="5"><base name="red" displaycolor="#FF0000"/></basematerials>
<object id="1" type="model" pid="5" pindex="0"><mesh>
<vertices><vertex x="0" y="0" z="0"/><vertex x="6" y="0" z="0"/><vertex x="0" y="1" z="0"/><vertex x="0" y="0" z="1"/></vertices>
<triangles><triangle v1="0" v2="2" v3="1"/><triangle v1="0" v2="1" v3="3"/>
<triangle v1="0" v2="3" v3="2"/><triangle v1="1" v2="2" v3="3"/></triangles>
</mesh></object></resources><build><item objectid="1"/></build></model>"""
with zipfile.ZipFile("a.3mf", "w") as package:
    package.writestr("[Content_Types].xml", TYPES)
    package.writestr("_rels/.rels", RELATIONS)
    package.writestr("3D/3dmodel.model", MODEL)
scene = trimesh.load_scene("a.3mf")
kinds = [mesh.visual.kind for mesh in scene.geometry.values()]
data = scene.export(file_type="glb")
document = json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])
placed = any("matrix" in node or "scale" in node for node in document["nodes"])
widest = max(accessor["max"][0] for accessor in document["accessors"] if accessor["type"] == "VEC3")
wide = scene.extents[0]
print(f"colours: {kinds}, unit {scene.units}, {wide} inches wide, {widest} metres in glTF, placed by matrices: {placed}")
sys.exit(0 if kinds == [None] and scene.units == "inch" and wide == widest == 6.0 else 1)
PYTHON
