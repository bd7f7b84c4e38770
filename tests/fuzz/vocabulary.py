"""Words that mean something to a reader: damage made of them reaches further than that of bytes."""

from __future__ import annotations

_DISPLAY = """
name title gap viewing_distance aperture_distance panel width height pixel_pitch subpixel_offsets subpixel_cells
lens_array layout pitch slant row_pitch offset infinite lenticular square hexagonal monitor slope center view_cone
rgb bgr none mm cm m in mil lpi dpi px print: monitor: size= dpi= pitch= lpi= ppi= cone= thickness= index= field=
[[ ]] [[[[ 1979-05-27
"""

_REQUEST = """
GET HEAD POST PUT OPTIONS HTTP/1.1 HTTP/1.0 HTTP/0.9 HTTP/9.9 Host: Origin: http://[ http://[::1 Content-Length: -1
Transfer-Encoding: chunked Expect: 100-continue If-Match: /pictures/0/manifest.json /pictures/0/tiles/picture/0_0
/pictures/999/manifest.json ../ %2e%2e /assets/viewer.js TOKEN
"""

_GLTF = """
KHR_draco_mesh_compression EXT_meshopt_compression KHR_texture_basisu KHR_techniques_webgl KHR_animation_pointer
EXT_mesh_gpu_instancing extensionsRequired ATTRIBUTES TRIANGLES INDICES OCTAHEDRAL QUATERNION EXPONENTIAL
KHR_gaussian_splatting KHR_gaussian_splatting:SCALE KHR_gaussian_splatting:SH_DEGREE_1_COEF_0 lin_rec709_display
KHR_gaussian_splatting_compression_spz_2 "mode":0 "mode":1 "mode":2 "mode":3 "version":"1.0"
"""

_WORDS = {
    "gltf": _GLTF,
    "glb": _GLTF,
    "obj": """
v vt vn f l p o g s usemtl mtllib newmtl map_Kd map_Ks map_d bump refl Kd Ks d Tr illum Ns Pr Pm -s -o -mm -bm -clamp on
t.png s.mtl 1/2/3 1//2 -1 # none.mtl Meshlab
""",
    "ply": """
ply format ascii binary_little_endian binary_big_endian 1.0 element vertex face property list char uchar short ushort
int uint float double end_header comment obj_info tristrips TextureFile t.png # -1 gap red green blue
""",
    "ply-splats": """
ply format ascii binary_little_endian binary_big_endian 1.0 element vertex chunk sh property float double half uint
uchar list end_header x f_dc_0 f_rest_0 f_rest_8 opacity scale_0 rot_0 packed_position packed_rotation packed_scale
packed_color min_x max_scale_z min_r nan inf
""",
    "spz": "NGSP",
    "sog": """
version count means scales quats sh0 shN mins maxs files codebook bands shape meta.json l.webp u.webp RIFF WEBP
VP8L VP8X
""",
    "off": "OFF ST C N 4 n BINARY # . 255 -1 1e400",
    "stl": "solid facet normal outer loop vertex endloop endfacet endsolid # // ; nan",
    "tachyon": """
BEGIN_SCENE END_SCENE CAMERA END_CAMERA TEXTURE TEXDEF TEXALIAS INCLUDE IMAGEDEF s.dat red # SPHERE CYLINDER FCYLINDER
PLANE RING TRI STRI BOX SCAPE VERTEXARRAY POLYCYLINDER EXTBOX SCALARVOL
""",
    "photograph": 'GDepth:Format="RangeLinear" GDepth:Near="0" GDepth:Far="inf" GDepth:Data=" http://ns.adobe.com/xap/1.0/',
    "heif": "ftyp meta iloc iinf iprp ipco ipma iref auxl auxC hvcC ispe irot pixi mdat heic :hevc:2015:auxid:2",
    "depth-map": "NUMPY descr fortran_order shape True False <f8 |O8 |u1 Pf PF -1.0 channels Z IHDR IDAT",
    "nifti": "n+1 n+2 ni1",
    "dicom": "DICM 1.2.840.10008.1.2 1.2.840.10008.1.2.4.70 1.2.840.10008.1.2.5 MONOCHROME1 RGB US SS OB OW SQ DS CT",
    "volume-npy": "NUMPY descr fortran_order shape True False <f8 |O8 |u1 >i2",
    "volume-npz": "NUMPY spacing.npy PK descr shape",
    "volume-vol": "VOL",
    "volume-vdb": " BDV density Tree_float_5_4_3 UniformScaleMap AffineMap file_voxel_count file_bbox_min vec3i int64",
    "vtk-vtp": "VTKFile PolyData Piece NumberOfPoints NumberOfPolys DataArray appended ascii base64 offset format",
    "vtk-vtk": "DATASET POLYDATA UNSTRUCTURED_GRID STRUCTURED_POINTS POINTS POLYGONS CELLS POINT_DATA SCALARS",
    "vtk-vti": "VTKFile ImageData WholeExtent Spacing Origin Direction Piece DataArray Int64 Float32 ascii",
    "transfer-function": "points per mm percent shading nan inf #ff8000 [ ] true",
    "molecule-pdb": "ATOM HETATM ANISOU CONECT MODEL ENDMDL TER CRYST1 SCALE1 ORIGX1 END REMARK LINK NAN -999.999",
    "molecule-xyz": 'Properties= "species:S:1:pos:R:3 :I:99 C 1 -1 nan 1e400',
    "molecule-cif": "data_ loop_ save_ _atom_site_fract_x _atom_site.Cartn_x _atom_site.type_symbol ? . ' \" ;",
    "usd": """
def over class Mesh Xform PointInstancer Material Shader SkelRoot Skeleton SkelAnimation Sphere Cube Capsule DomeLight
RectLight SphereLight Camera GeomSubset references payload subLayers variantSet variants point3f[] int[] token float
faceVertexCounts faceVertexIndices holeIndices protoIndices prototypes positions instanceable timeSamples inputs:file
"catmullClark" "none" "leftHanded" "faceVarying" "uniform" interpolation = ( ) [ ] { } @s.usda@ </m> None inf nan -1
""",
    "mitsuba-xml": """
scene version include filename default path integrator sensor film sampler texture bsdf shape emitter medium phase
volume spectrum rgb float integer boolean string point vector transform matrix lookat rotate scale translate ref id
alias name value type $spp m.ply s.xml lamps.xml ../s.xml /etc/passwd obj cube bitmap envmap instance shapegroup
homogeneous heterogeneous hdrfilm specfilm width height batch plugin diffuse dielectric thindielectric roughdielectric
conductor roughconductor hair measured plastic roughplastic bumpmap normalmap blendbsdf mask twosided principled
principledthin null area point constant spot projector directional directionalarea sunsky isotropic hg rayleigh sggx
checkerboard mesh_attribute volume_adapter gridvolume constvolume uniform srgb blackbody irregular ply serialized sphere
cylinder disk rectangle bsplinecurve linearcurve sdfgrid ellipsoids ellipsoidsmesh merge independent stratified aov path
volpath ptracer direct moment depth stokes perspective thinlens orthographic distant radiancemeter irradiancemeter
fileresolver <!-- --> <!DOCTYPE <!ENTITY CDATA &amp; &x; <?xml encoding
""",
    "environment": "#?RADIANCE #?RGBE FORMAT= 32-bit_rle_rgbe EXPOSURE= -Y +X +Y 2 4 channels dataWindow tiles box2i",
    "texture": "IHDR PLTE tRNS IDAT IEND iCCP JFIF Exif RIFF WEBP VP8 VP8L VP8X BM GIF89a P3 P6 P7",
    "nff": "v b l f s c p pp from at up angle hither resolution #",
    "display-toml": _DISPLAY,
    "short-form": _DISPLAY,
    "words": ": 0:48 :: , x 1e9 g GiB %d %04d %% tcp:// tls:// local:2 [::1] :8786 @ ? frame_ .png",
    "quilt-picture": "JFIF Exif",
    "journal": "=== r0000_c0000.tile r0000_c0001.tile r-001_c0000.tile job.json lock grid fingerprint LpTile2",
    "frame-journal": "lippmann-frames fingerprint frame sum chosen method denoise version spp 4 0 true null",
    "tile": "LpTile2 pixels maps sums depth error primary |u1 <f4 <f8 |O <U9999999 <M8[s] V0",
    "quilt-name": "_qs 8x6 a0.75 .png .jpg x a",
    "picture-png": "IHDR iTXt IDAT IEND sRGB pHYs tRNS PLTE",
    "picture-exr": "channels compression dataWindow displayWindow lineOrder tiles string box2i chlist",
    "picture-zarr": "=== c/0/0/0 zarr.json",
    "pieces-zarr": "=== c/0/0/0 zarr.json",
    "pfm": "Pf PF -1.0",
    "viewer-request": _REQUEST,
    "calibration-request": _REQUEST,
}

VOCABULARY: dict[str, tuple[bytes, ...]] = {
    name: tuple(word.encode("ascii") for word in text.split()) for name, text in _WORDS.items()
}
