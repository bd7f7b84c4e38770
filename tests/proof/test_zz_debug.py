import math
import numpy as np, pytest
from dataclasses import replace
import importlib.util, sys
from pathlib import Path
spec=importlib.util.spec_from_file_location("trm",Path(__file__).parent/"test_replay_against_mitsuba.py"); t=importlib.util.module_from_spec(spec); sys.modules["trm"]=t; spec.loader.exec_module(t)
@pytest.mark.usefixtures("engine")
def test_d(glowing, build_once):
    sheet=t.SLANTED
    sc=glowing("teapot"); made=t.rendered(sc,sheet,True); built=build_once(sc)
    eye=(-263.0, 35.1, 700.0); size=(31,37)
    seen=made.position.replay(eye,size=size).reshape(-1,3)
    d=sheet.display()
    for c,off in enumerate(t.RGB_STRIPE):
        pts=t.lens_plane_points(sheet,*size)
        s=t.samples_of(sheet,pts,eye,off); dd=t.direct_pictures(built,made.matrix,sheet,s)
        err=np.abs(seen[:,c]-dd.position[:,c])
        bad=np.flatnonzero((err>1e-3)&s.clear&dd.stable&dd.hit)
        for b in bad:
            print(c,pts[b],eye,seen[b],dd.position[b],dd.hit[b],s.points[b],s.viewpoints[b])
            q=d.panel_point_seen_by(*eye,*pts[b]); u,v=d.pixel_coordinates(*q); print(u-off[0],v, d.lens_of(*pts[b]))
            lens,_=sheet.nearest_lens(pts[b:b+1]); print(lens, sheet.to_axes(pts[b]), sheet.pitch)
            for k in (-1,0,1):
                x,y=d.panel_point(np.floor(u-off[0])+k+.5+off[0], np.floor(v)+.5); print(k,d.lens_of(x,y), d.lattice.across(x,y)/d.lattice.pitch-d.lattice.origin_x/d.lattice.pitch)
    import mitsuba as mi, drjit as dr
    print("pixel", [p.pixels[31,81] for p in (made.position,made.normal,made.emission)])
    print(d.panel_point(81.5,31.5), d.light_ray(*[np.float64(a) for a in d.panel_point(81.5,31.5)]))
    from lippmann.render.rays import DisplayRays
    src=DisplayRays(d,made.matrix,True)
    ray=src.rays(mi.UInt32(81),mi.UInt32(31),mi.UInt32(1),mi.Point2f(.5))
    print(ray.o,ray.d)
    for dd_ in ((0,0,0),(1e-4,0,0),(0,1e-4,0),(-1e-4,0,0),(0,-1e-4,0),(0,0,-1),(0,0,1)):
        r=mi.Ray3f(ray.o+mi.Vector3f(dd_),ray.d); si=built.mitsuba.ray_intersect(r); print(dd_,si.t,si.p, si.shape, si.prim_index)
